//! What a flow will take, said without a library or a device: chunks, evaluations, memory. Runs nothing.

use physvideo::scene::{Flow, Solver, Start};
use physvideo::stages::latent::{LatentSetup, LatentSpace};
use physvideo_net::{Grid, Guidance, Manifest, Prediction};

use super::chunks::stretches;
use super::model::{self, NetChoice};
use super::velocity::FlowError;
use crate::error::AppError;
use crate::load::Loaded;

/// What a flow will take.
#[derive(Clone, Debug, PartialEq)]
pub struct Outlook {
    /// Name of the model.
    pub model: String,
    /// Size of its frames [px].
    pub size: (u32, u32),
    /// Latents of the largest chunk: channels, time, rows, columns.
    pub latent: [usize; 4],
    /// Chunks.
    pub chunks: usize,
    /// Evaluations of v_θ in all.
    pub nfe: u64,
    /// Device memory of the latents [bytes].
    pub latent_bytes: u64,
    /// Memory of the networks [bytes].
    pub network_bytes: u64,
}

impl Outlook {
    /// Reads the manifest and counts; `frames` are the clip's, each of `size` [px].
    ///
    /// # Errors
    /// A model that is not there or does not take that size, at its key where the scene names it.
    pub fn new(loaded: &Loaded, choice: &NetChoice, size: (u32, u32), frames: usize) -> Result<Option<Self>, AppError> {
        let Some(flow) = &loaded.scene.flow else { return Ok(None) };
        let manifest = Manifest::read(&model::folder(loaded, flow, choice)?)?;
        let size = model::size(flow, &manifest, size)?;
        model::check_steps(flow, &manifest)?;
        let chunk = &manifest.chunk;
        let all = stretches(frames, chunk.frames, manifest.latent.temporal, chunk.fixed || chunk.history > 0);
        let longest = all.iter().map(|s| s.padded).max().unwrap_or(1);
        let Grid { frames: t, height: h, width: w } =
            manifest.grid(longest, size.1 as usize, size.0 as usize).map_err(FlowError::Net)?;
        let latent = [manifest.latent.channels, t, h, w];
        Ok(Some(Self {
            model: manifest.name.clone(),
            size,
            latent,
            chunks: all.len(),
            nfe: all.len() as u64 * evaluations(flow),
            latent_bytes: LatentSpace::bytes(&setup(flow, &manifest, latent)),
            network_bytes: manifest.memory(&manifest.for_clips()).map_err(FlowError::Net)?,
        }))
    }
}

/// Evaluations of v_θ of a chunk.
fn evaluations(flow: &Flow) -> u64 {
    let walks = u64::from(flow.tau_step) * if flow.solver == Solver::Heun { 2 } else { 1 };
    walks * (1 + u64::from(flow.start == Start::Inversion)) + u64::from(flow.iterations)
}

fn setup(flow: &Flow, manifest: &Manifest, [c, t, h, w]: [usize; 4]) -> LatentSetup<'static> {
    let velocity = manifest.velocity.as_ref();
    let plain = |p: Prediction| matches!(p, Prediction::EpsMinusX0 | Prediction::X0MinusEps);
    LatentSetup {
        elements: (c * t * h * w) as u64,
        cells: (t * h * w) as u64,
        guided: velocity.is_some_and(|v| matches!(v.guidance, Guidance::Cfg { .. })),
        apart: velocity.is_some_and(|v| !plain(v.prediction)),
        history: flow.solver != Solver::Euler,
        ..LatentSetup::default()
    }
}

//! What a flow will take, said without a library or a device: chunks, evaluations, memory. Runs nothing.

use physvideo::flow::stable_gamma;
use physvideo::scene::{Flow, Pool, Sde, Solver, Start};
use physvideo::stages::latent::mask::{Pooling, pooling_bytes};
use physvideo::stages::latent::{LatentSetup, LatentSpace};
use physvideo_net::{Grid, Guidance, Manifest};

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
    /// Noise level σ of the SDE.
    pub sigma: f64,
    /// Device memory of the latents and of pooling masks [bytes].
    pub latent_bytes: u64,
    /// Host memory of frames on their way through the codec [bytes].
    pub frame_bytes: u64,
    /// Memory of the networks [bytes].
    pub network_bytes: u64,
    /// What a user should know.
    pub notes: Vec<String>,
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
        model::embeddings(loaded, flow, &manifest)?;
        let chunk = &manifest.chunk;
        let all = stretches(frames, chunk.frames, manifest.latent.temporal, chunk.fixed || chunk.history > 0);
        let longest = all.iter().map(|s| s.padded).max().unwrap_or(1);
        let grid = manifest.grid(longest, size.1 as usize, size.0 as usize).map_err(FlowError::Net)?;
        let Grid { frames: t, height: h, width: w } = grid;
        let rule = model::rule(flow, &manifest, grid)?;
        let mut notes = model::idle(flow, &manifest);
        let limit = stable_gamma(rule.tau);
        if rule.gamma > limit && matches!(flow.sde, Sde::EulerMaruyama | Sde::LeimkuhlerMatthews) {
            let (gamma, sigma) = (rule.gamma, rule.tau);
            notes.push(format!("flow.gamma {gamma} is above 2σ² = {limit:.4} at σ = {sigma:.4}: the SDE may diverge"));
        }
        // A linked clip goes through the codec as one.
        let through = if chunk.history > 0 { all.len() * (chunk.frames - 1) + 1 } else { longest };
        let pixels = u64::from(size.0) * u64::from(size.1);
        let pooling = Pooling {
            size,
            frames: through as u32,
            spatial: manifest.latent.spatial as u32,
            temporal: manifest.latent.temporal as u32,
            pool: Pool::Any,
            reach: 0,
            first: true,
        };
        let latent = [manifest.latent.channels, t, h, w];
        Ok(Some(Self {
            model: manifest.name.clone(),
            size,
            latent,
            chunks: all.len(),
            nfe: all.len() as u64 * evaluations(flow, &manifest)?,
            sigma: rule.tau,
            latent_bytes: LatentSpace::bytes(&setup(flow, &manifest, latent)).max(pooling_bytes(&pooling)),
            // Kept frames and masks; the codec's colours as f32, and what it makes of them.
            frame_bytes: pixels * (7 * frames as u64 + CODEC_COPIES * 12 * through as u64),
            notes,
            network_bytes: manifest.memory(&manifest.for_clips()).map_err(FlowError::Net)?,
        }))
    }
}

/// Copies of a stretch of frames as f32 that encoding holds at once: the tensor, its colours in the network's range and
/// layout, and the network's own.
const CODEC_COPIES: u64 = 4;

/// Evaluations of v_θ of a chunk.
fn evaluations(flow: &Flow, manifest: &Manifest) -> Result<u64, FlowError> {
    let (_, tau) = model::steps(flow, manifest)?;
    let walks = tau.0 as u64 * if flow.solver == Solver::Heun { 2 } else { 1 };
    Ok(walks * (1 + u64::from(flow.start == Start::Inversion)) + u64::from(flow.iterations))
}

fn setup(flow: &Flow, manifest: &Manifest, [c, t, h, w]: [usize; 4]) -> LatentSetup<'static> {
    let velocity = manifest.velocity.as_ref();
    LatentSetup {
        elements: (c * t * h * w) as u64,
        cells: (t * h * w) as u64,
        guided: velocity.is_some_and(|v| matches!(v.guidance, Guidance::Cfg { .. })),
        apart: velocity.is_some_and(|v| !v.prediction.is_plain()),
        history: flow.solver != Solver::Euler,
        ..LatentSetup::default()
    }
}

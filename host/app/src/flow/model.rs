//! From `[flow]` of a scene to an opened model and settled settings, before anything is simulated, so that what is
//! missing is told at once. Runs no network.

use std::path::PathBuf;

use physvideo::scene::Flow;
use physvideo_net::{Embeddings, LibraryChoice, Manifest, Model, OpenOptions, Provider, Runtime, StepIndex};

use super::settings::Settings;
use super::stage::pool_of;
use super::velocity::FlowError;
use crate::device::host_memory;
use crate::error::AppError;
use crate::interrupt::Interrupt;
use crate::load::Loaded;

/// Where networks run, as the command line says.
#[derive(Clone, Debug, Default)]
pub struct NetChoice {
    /// The library (`--ort-lib`).
    pub library: Option<PathBuf>,
    /// The provider (`--provider`).
    pub provider: Provider,
    /// The model's folder in place of the scene's (`--model`).
    pub model: Option<PathBuf>,
}

/// A model ready to run, and everything decided.
pub struct FlowModel {
    /// The model.
    pub model: Model,
    /// The settings.
    pub settings: Settings,
    /// Size of its frames [px].
    pub size: (u32, u32),
    /// What a user should know.
    pub notes: Vec<String>,
}

/// The folder of a scene's model.
///
/// # Errors
/// A path that is not there or leaves the asset root, at its key.
pub fn folder(loaded: &Loaded, flow: &Flow, choice: &NetChoice) -> Result<PathBuf, AppError> {
    match &choice.model {
        Some(folder) => Ok(folder.clone()),
        None => loaded.resolve_at("flow.model", &flow.model),
    }
}

/// Width and height for the network: as the scene says, else the frames', each made a multiple of what the model takes.
///
/// # Errors
/// A size in the scene that the model does not take, with the nearest that it does.
pub fn size(flow: &Flow, manifest: &Manifest, frames: (u32, u32)) -> Result<(u32, u32), FlowError> {
    let unit = (manifest.latent.spatial * manifest.latent.multiple).max(1) as u32;
    match flow.size {
        None => Ok((frames.0.max(unit) / unit * unit, frames.1.max(unit) / unit * unit)),
        Some([w, h]) if w % unit == 0 && h % unit == 0 => Ok((w, h)),
        Some([w, h]) => {
            let near = |s: u32| ((s + unit / 2) / unit).max(1) * unit;
            Err(FlowError::Input(format!(
                "flow.size {w} × {h} does not fit the model, which takes multiples of {unit}: the nearest is {} × {}",
                near(w),
                near(h)
            )))
        }
    }
}

/// Opens the library and the model, and settles what the scene leaves open.
///
/// # Errors
/// The library, the model's files, embeddings, or a size that does not fit.
pub fn open(
    loaded: &Loaded,
    flow: &Flow,
    choice: &NetChoice,
    frames: (u32, u32),
    interrupt: &Interrupt,
) -> Result<FlowModel, AppError> {
    let manifest = Manifest::read(&folder(loaded, flow, choice)?)?;
    let size = size(flow, &manifest, frames)?;
    let mut notes = Vec::new();
    let file = |key: &str, path: &Option<PathBuf>| -> Result<Option<Embeddings>, AppError> {
        let Some(path) = path else { return Ok(None) };
        Ok(Some(Embeddings::read(&loaded.resolve_at(key, path)?)?))
    };
    let embeddings =
        [file("flow.embeddings", &flow.embeddings)?, file("flow.negative_embeddings", &flow.negative_embeddings)?];
    if !flow.prompt.is_empty() && embeddings[0].is_none() {
        notes.push("flow.prompt is kept in the report only: networks read flow.embeddings".into());
    }
    let settings = settings(flow, &manifest, embeddings, loaded.scene.seed)?;
    let library = LibraryChoice { path: choice.library.clone(), provider: choice.provider, threads: None };
    let runtime = Runtime::load(&library)?;
    let flag = interrupt.flag();
    let roles = manifest.for_clips();
    let options = OpenOptions { roles: &roles, available_memory: host_memory(), cancel: Some(&flag) };
    let model = Model::open(&runtime, manifest, &options)?;
    Ok(FlowModel { model, settings, size, notes })
}

/// The decimal that the scene's f32 was written as: 0.2, not 0.200000003.
fn decimal(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::from(number))
}

/// Refuses a step of the SDE beyond the schedule.
pub(super) fn check_steps(flow: &Flow, manifest: &Manifest) -> Result<(), FlowError> {
    let missing = || FlowError::Input(format!("model {} has no velocity network", manifest.name));
    let all = flow.steps.map_or(manifest.velocity.as_ref().ok_or_else(missing)?.schedule.steps, |s| s as usize);
    if flow.tau_step as usize <= all {
        return Ok(());
    }
    Err(FlowError::Input(format!(
        "flow.tau_step {} is beyond the {all} steps of the model's schedule: lower it, or set flow.steps",
        flow.tau_step
    )))
}

fn settings(
    flow: &Flow,
    manifest: &Manifest,
    embeddings: [Option<Embeddings>; 2],
    seed: u64,
) -> Result<Settings, FlowError> {
    check_steps(flow, manifest)?;
    let (pool, reach) = pool_of(flow);
    let steps = flow.steps.map(|s| s as usize);
    Ok(Settings {
        act: flow.act,
        steps,
        tau: StepIndex(flow.tau_step as usize),
        iterations: flow.iterations,
        gamma: decimal(flow.gamma),
        beta: flow.beta.map(decimal),
        sde: flow.sde,
        solver: flow.solver,
        start: flow.start,
        pool,
        reach,
        guidance: flow.guidance.map(decimal),
        inversion_guidance: decimal(flow.inversion_guidance),
        embeddings,
        continuation: flow.continuation,
        noise: flow.noise,
        seed,
    })
}

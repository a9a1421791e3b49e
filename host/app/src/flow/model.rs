//! From `[flow]` of a scene to an opened model and settled settings, before anything is simulated, so that what is
//! missing is told at once. Runs no network.

use std::path::PathBuf;

use physvideo::flow::SdeRule;
use physvideo::scene::{Continuation, Flow, Pool, Problem};
use physvideo_net::{
    Embeddings, Grid, Guidance, Kind, LibraryChoice, Manifest, Model, OpenOptions, Provider, Runtime, Schedule,
    ScheduleSpec, Source as NetSource, StepIndex,
};

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
    let embeddings = embeddings(loaded, flow, &manifest)?;
    let settings = settings(flow, &manifest, embeddings, loaded.scene.seed)?;
    let library = LibraryChoice { path: choice.library.clone(), provider: choice.provider, threads: None };
    let runtime = Runtime::load(&library)?;
    let flag = interrupt.flag();
    let roles = manifest.for_clips();
    let options = OpenOptions { roles: &roles, available_memory: host_memory(), cancel: Some(&flag) };
    let model = Model::open(&runtime, manifest, &options).map_err(|e| match e.kind() {
        Kind::Interrupted => FlowError::Interrupted { at: "loading the network".into(), kept: false },
        _ => FlowError::Net(e),
    })?;
    Ok(FlowModel { model, settings, size })
}

/// Arrays that the velocity network reads from embeddings, and whether each may be absent.
fn read_arrays(manifest: &Manifest) -> Vec<(&str, bool)> {
    let inputs = manifest.velocity.iter().flat_map(|v| &v.inputs);
    inputs
        .filter_map(|input| match &input.source {
            NetSource::Embedding { key, optional_zeros } => Some((key.as_str(), optional_zeros.is_some())),
            _ => None,
        })
        .collect()
}

/// The scene's embedding files, each with the arrays that the model reads and no others.
///
/// # Errors
/// A file that cannot be read, at its key; arrays the model does not know; one it needs and nobody gives.
pub(super) fn embeddings(
    loaded: &Loaded,
    flow: &Flow,
    manifest: &Manifest,
) -> Result<[Option<Embeddings>; 2], AppError> {
    let wanted = read_arrays(manifest);
    let problem = |key: &str, text: String| loaded.locate(vec![Problem::new(physvideo::scene::Kind::Path, key, text)]);
    let file = |key: &str, path: &Option<PathBuf>| -> Result<Option<Embeddings>, AppError> {
        let Some(path) = path else { return Ok(None) };
        let read = Embeddings::read(&loaded.resolve_at(key, path)?).map_err(|e| problem(key, e.to_string()))?;
        let unknown = read.keys().find(|k| !wanted.iter().any(|(w, _)| w == k)).map(str::to_owned);
        match unknown {
            None => Ok(Some(read)),
            Some(unknown) => {
                let known: Vec<&str> = wanted.iter().map(|w| w.0).collect();
                let reads = if known.is_empty() { "no embeddings".into() } else { known.join(", ") };
                let text = format!("it holds `{unknown}`, and model {} reads {reads}", manifest.name);
                Err(problem(key, text))
            }
        }
    };
    let both =
        [file("flow.embeddings", &flow.embeddings)?, file("flow.negative_embeddings", &flow.negative_embeddings)?];
    let own = manifest.velocity.as_ref().is_some_and(|v| v.embeddings.is_some());
    let given = |key: &str| both[0].as_ref().is_some_and(|e| e.keys().any(|k| k == key));
    match wanted.iter().find(|(key, optional)| !optional && !own && !given(key)) {
        None => Ok(both),
        Some((key, _)) => {
            let text = format!("model {} needs the array `{key}`, and no file gives it", manifest.name);
            Err(problem("flow.embeddings", text))
        }
    }
}

/// Keys of the scene that this model has no use for.
pub(super) fn idle(flow: &Flow, manifest: &Manifest) -> Vec<String> {
    let guidance = manifest.velocity.as_ref().map(|v| &v.guidance);
    let two = matches!(guidance, Some(Guidance::Cfg { .. }));
    let model = &manifest.name;
    let mut notes = Vec::new();
    let mut note = |when: bool, text: String| {
        if when {
            notes.push(text);
        }
    };
    note(
        !flow.prompt.is_empty() && flow.embeddings.is_none(),
        "flow.prompt is kept in the report only: networks read flow.embeddings".into(),
    );
    note(
        flow.guidance.is_some() && matches!(guidance, Some(Guidance::None)),
        format!("flow.guidance has no effect: model {model} takes none"),
    );
    note(
        flow.inversion_guidance != 1.0 && !two,
        format!("flow.inversion_guidance has no effect: model {model} is not guided by two predictions"),
    );
    note(
        flow.continuation != Continuation::default() && manifest.chunk.history > 0,
        format!("flow.continuation has no effect: chunks of model {model} see their neighbours' latents"),
    );
    notes
}

/// The decimal that the scene's f32 was written as: 0.2, not 0.200000003.
fn decimal(number: f32) -> f64 {
    number.to_string().parse().unwrap_or(f64::from(number))
}

/// Steps of the schedule and the one at which the SDE runs.
///
/// # Errors
/// A step beyond the schedule, or a model without one.
pub(super) fn steps(flow: &Flow, manifest: &Manifest) -> Result<(usize, StepIndex), FlowError> {
    let missing = || FlowError::Input(format!("model {} has no velocity network", manifest.name));
    let all = flow.steps.map_or(manifest.velocity.as_ref().ok_or_else(missing)?.schedule.steps, |s| s as usize);
    let tau = flow.tau_of(all);
    if tau <= all {
        return Ok((all, StepIndex(tau)));
    }
    Err(FlowError::Input(format!(
        "flow.tau_step {tau} is beyond the {all} steps of the model's schedule: lower it, or set flow.steps"
    )))
}

/// The SDE's integrator at the noise level of a grid of latents.
///
/// # Errors
/// What of it does not go together.
pub(super) fn rule(flow: &Flow, manifest: &Manifest, grid: Grid) -> Result<SdeRule, FlowError> {
    let (all, tau) = steps(flow, manifest)?;
    let missing = || FlowError::Input(format!("model {} has no velocity network", manifest.name));
    let spec = &manifest.velocity.as_ref().ok_or_else(missing)?.schedule;
    let schedule = Schedule::new(&ScheduleSpec { steps: all, ..spec.clone() }, grid)?;
    let soft = pool_of(flow).0 == Pool::Share;
    let sigma = schedule.sigma(tau).value();
    Ok(SdeRule::new(flow.sde, decimal(flow.gamma), sigma, flow.beta.map(decimal), soft)?)
}

fn settings(
    flow: &Flow,
    manifest: &Manifest,
    embeddings: [Option<Embeddings>; 2],
    seed: u64,
) -> Result<Settings, FlowError> {
    let (_, tau) = steps(flow, manifest)?;
    let (pool, reach) = pool_of(flow);
    Ok(Settings {
        act: flow.act,
        steps: flow.steps.map(|s| s as usize),
        tau,
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

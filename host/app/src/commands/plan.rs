//! `plan`: what a run would do and take, as a table. Writes nothing and compiles nothing.

use std::path::{Path, PathBuf};

use physvideo::assemble::assemble;
use physvideo::elastic::Choice;
use physvideo::estimate::{Estimate, estimate, step_notes};
use physvideo::plan::Plan;
use physvideo_gpu::{DeviceInfo, Feature, GpuError, kernels};

use super::print;
use crate::budget;
use crate::cli::Overrides;
use crate::device;
use crate::error::AppError;
use crate::flow::{NetChoice, Outlook, Source};
use crate::load::Loaded;

pub(super) fn plan(
    path: &Path,
    overrides: &Overrides,
    asked: Option<&str>,
    model: Option<&PathBuf>,
) -> Result<(), AppError> {
    let mut loaded = Loaded::open(path, overrides)?;
    let plan = loaded.plan();
    // Planning goes without a device; one that was asked for by name must be there.
    let device = match physvideo_gpu::choose_device(asked) {
        Err(e @ GpuError::UnknownDevice { .. }) => return Err(e.into()),
        found => found,
    };
    let mut inputs = loaded.inputs(&plan)?;
    inputs.memory = device.as_ref().map_or_else(|_| device::host_memory(), |d| Some(device::available(d)));
    let chosen = budget::apply(&mut loaded, &inputs, &plan)?;
    let assembled = assemble(&loaded.scene, &inputs, &plan).map_err(|p| loaded.locate(vec![p]))?;
    let has = |f: Feature| device.as_ref().is_ok_and(|d| d.features.contains(&f));
    let two_pass = !(has(Feature::Int64) && has(Feature::Int64Atomic));
    let estimate = estimate(&loaded.scene, &assembled, &plan, two_pass);

    print(&stages(&plan, &assembled.elastic));
    if plan.runs("simulate") {
        print(&format!("{:<12} {}", "solver", assembled.solver()));
    }
    for body in &assembled.world.bodies {
        print(&format!("{:<12} {} particles", body.name, body.positions.len()));
    }
    let steps = step_notes(&assembled.world, loaded.scene.output.fps);
    for note in chosen.iter().chain(&assembled.notes).chain(&steps) {
        print(&format!("{:<12} {note}", "note"));
    }
    print(&numbers(&loaded, &plan, &estimate, assembled.elastic.name().is_some()));
    let mut latents = 0;
    if plan.runs("flow") {
        let frames = driven(&loaded, assembled.size)?;
        let choice = NetChoice { model: model.cloned(), ..NetChoice::default() };
        if let Some(outlook) = Outlook::new(&loaded, &choice, frames.0, frames.1)? {
            latents = outlook.latent_bytes;
            print(&flow(&outlook));
        }
    }
    print(&memory(&estimate, latents, device));
    Ok(())
}

/// Size and number of the frames that the network is given.
pub(super) fn driven(loaded: &Loaded, drawn: (u32, u32)) -> Result<((u32, u32), usize), AppError> {
    let asked = loaded.scene.output.frames as usize;
    match loaded.scene.flow.as_ref().and_then(|f| f.input.as_ref()) {
        None => Ok((drawn, asked)),
        Some(input) => {
            let source = Source::read(loaded, input, asked)?;
            Ok((source.frames.first().map_or(drawn, |f| f.size), source.frames.len()))
        }
    }
}

fn flow(outlook: &Outlook) -> String {
    let Outlook { model, size: (width, height), latent: [c, t, h, w], chunks, nfe, sigma, .. } = outlook;
    let chunks = if *chunks == 1 { "1 chunk".to_owned() } else { format!("{chunks} chunks") };
    let mib = |bytes: u64| bytes.div_ceil(1 << 20);
    let (networks, frames) = (mib(outlook.network_bytes), mib(outlook.frame_bytes));
    let mut lines = vec![format!(
        "{:<12} model {model} at {width} × {height}, latents {c} × {t} × {h} × {w}, {chunks}, {nfe} evaluations, SDE at \
         σ = {sigma:.4}; host memory: {networks} MiB of networks without what they compute, {frames} MiB of frames",
        "network"
    )];
    lines.extend(outlook.notes.iter().map(|note| format!("{:<12} {note}", "note")));
    lines.join("\n")
}

fn stages(plan: &Plan, elastic: &Choice) -> String {
    let line = |stage: &physvideo::plan::Planned| match &stage.skipped {
        None => {
            let solvers = elastic.name().filter(|_| stage.name == "simulate");
            format!("{:<12} run      {}", stage.name, solvers.unwrap_or(stage.what))
        }
        Some(reason) => format!("{:<12} skipped  {reason}", stage.name),
    };
    plan.stages.iter().map(line).collect::<Vec<_>>().join("\n")
}

/// `own`: some bodies are on grids of their own, whose contact stiffens as it deepens.
fn numbers(loaded: &Loaded, plan: &Plan, estimate: &Estimate, own: bool) -> String {
    let Estimate { particles, points, substeps, fastest, most_substeps, .. } = estimate;
    let frames = loaded.scene.output.frames;
    let mut lines = Vec::new();
    if plan.runs("simulate") {
        // The first frame is the start itself.
        let all = substeps * f64::from(frames.saturating_sub(1));
        // What moves slowly beside its waves takes the steps it began with.
        let more = match *most_substeps > 1.2 * substeps {
            true => {
                format!("; up to {most_substeps} a frame at {fastest:.1} m/s, the most that falls and forces can give")
            }
            false => String::new(),
        };
        let more = more + if own { "; several times that while elastic bodies press hard on something" } else { "" };
        lines.push(format!(
            "{:<12} {particles} in all, about {substeps} substeps a frame, {all} in all{more}",
            "particles"
        ));
    }
    if plan.runs("render") {
        lines.push(format!("{:<12} {frames} frames of {points} points", "drawing"));
    }
    lines.push(format!("{:<12} at most {} are compiled", "pipelines", most_pipelines(loaded, plan)));
    lines.join("\n")
}

/// Kernels in the folders of the stages that run; variants that a scene does not use are not compiled.
fn most_pipelines(loaded: &Loaded, plan: &Plan) -> usize {
    let used = |folder: &str| match folder {
        "source" => plan.runs("simulate") && loaded.scene.objects.iter().any(|o| o.recycle.is_some()),
        "cells" | "mpm" | "lagrangian" => plan.runs("simulate"),
        "points" => plan.runs("render"),
        "latent" => plan.runs("flow"),
        _ => false,
    };
    kernels::KERNELS.iter().filter(|k| k.name.split_once('/').is_some_and(|(folder, _)| used(folder))).count()
}

fn memory(estimate: &Estimate, latents: u64, device: Result<DeviceInfo, GpuError>) -> String {
    let Estimate { bytes, simulation_bytes, drawing_bytes, .. } = estimate;
    let bytes = bytes + latents;
    let latents = if latents > 0 { format!(", {latents} latents") } else { String::new() };
    let need = format!("{bytes} bytes ({simulation_bytes} simulation, {drawing_bytes} drawing{latents})");
    match device {
        Ok(info) => {
            let available = device::available(&info);
            let verdict = if bytes <= available { "fits" } else { "does not fit" };
            format!("{:<12} {need}, {verdict} in {available} bytes on {}", "memory", info.name)
        }
        Err(e) => format!("{:<12} {need}; not compared: {e}", "memory"),
    }
}

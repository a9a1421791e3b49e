//! `check`: everything that can be found wrong with a scene and its files without a device.

use std::path::Path;

use physvideo::assemble::assemble;
use physvideo::estimate::step_notes;

use super::print;
use crate::budget;
use crate::cli::Overrides;
use crate::device;
use crate::error::AppError;
use crate::flow::{NetChoice, Outlook};
use crate::load::Loaded;

pub(super) fn check(path: &Path) -> Result<(), AppError> {
    let mut loaded = Loaded::open(path, &Overrides::default())?;
    let plan = loaded.plan();
    let mut inputs = loaded.inputs(&plan)?;
    inputs.memory = device::host_memory();
    budget::apply(&mut loaded, &inputs, &plan)?;
    let assembled = assemble(&loaded.scene, &inputs, &plan).map_err(|p| loaded.locate(vec![p]))?;
    if plan.runs("flow") {
        let (size, frames) = super::plan::driven(&loaded, assembled.size)?;
        Outlook::new(&loaded, &NetChoice::default(), size, frames)?;
    }
    let particles: usize = assembled.world.bodies.iter().map(|b| b.positions.len()).sum();
    print(&format!("{}: ok, {} objects, {particles} particles", path.display(), loaded.scene.objects.len()));
    let steps = step_notes(&assembled.world, loaded.scene.output.fps);
    for note in assembled.notes.iter().chain(&steps) {
        print(&format!("{:<12} {note}", "note"));
    }
    Ok(())
}

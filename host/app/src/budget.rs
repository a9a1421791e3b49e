//! `--error-budget`: sets a scene's grid and Courant number to the cheapest that measured tables allow. Knows no solver.

use physvideo::accuracy::{self, Fit, fit};
use physvideo::assemble::{Inputs, assemble};
use physvideo::plan::Plan;
use physvideo::scene::{Kind, Problem, Simulation, Source};
use physvideo::world::Body;

use crate::error::AppError;
use crate::load::Loaded;

/// Particles a cell the tables were measured with.
const PER_CELL: u32 = 8;
/// Grids that may be tried until the solver of one is the one it was chosen for.
const TRIES: u32 = 3;

/// Changes the settings of a scene that has an error budget; says what was chosen.
///
/// # Errors
/// A budget that cannot be met, or a body whose particles are given.
pub fn apply(loaded: &mut Loaded, inputs: &Inputs, plan: &Plan) -> Result<Option<String>, AppError> {
    let Some(budget) = loaded.scene.simulation.error_budget else { return Ok(None) };
    if !plan.runs("simulate") {
        return Ok(None);
    }
    let given = |o: &physvideo::scene::Object| o.material.is_some() && matches!(o.source, Source::Points { .. });
    if let Some(index) = loaded.scene.objects.iter().position(given) {
        let message = "its particles are given, so an error budget cannot choose them";
        let key = format!("object[{index}].source.points");
        return Err(loaded.locate(vec![Problem::new(Kind::Conflict, &key, message).help("remove the error budget")]));
    }
    // Bodies as the scene has them, to see how thick they are and who moves them.
    let mut bodies = assemble(&loaded.scene, inputs, plan).map_err(|p| loaded.locate(vec![p]))?;
    for _ in 0..TRIES {
        let own = bodies.elastic.total_lagrangian;
        let chosen = fit(&bodies.world, own, budget).map_err(|e| AppError::Numeric(e.to_string()))?;
        let Some(chosen) = chosen else { return Ok(None) };
        let said = set(&mut loaded.scene.simulation, &chosen, budget, bodies.world.is_fluid());
        // What falls has a table for each of the solvers, and another grid may be another's.
        let falls = |b: &Body| b.material.elastic() && !b.pinned.contains(&true);
        if !bodies.world.bodies.iter().any(falls) {
            return Ok(Some(said));
        }
        bodies = assemble(&loaded.scene, inputs, plan).map_err(|p| loaded.locate(vec![p]))?;
        if bodies.elastic.total_lagrangian == own {
            return Ok(Some(said));
        }
    }
    let message = "which solver moves the bodies depends on the grid, and their errors on the solver";
    let help = "take \"updated_lagrangian\" or \"total_lagrangian\" with an error budget here";
    Err(loaded.locate(vec![Problem::new(Kind::Conflict, "simulation.elastic", message).help(help)]))
}

/// Sets what was chosen; says it.
fn set(simulation: &mut Simulation, chosen: &Fit, budget: f32, fluid: bool) -> String {
    simulation.courant = chosen.courant;
    let unit = if fluid {
        simulation.particle_size = 1.0 / chosen.density;
        "particles"
    } else {
        simulation.grid_density = chosen.density;
        simulation.particles_per_cell = PER_CELL;
        "cells"
    };
    let what = if chosen.kind == accuracy::Kind::Held { "bending" } else { "the way of a falling block" };
    format!(
        "error budget {budget}: {:.1} {unit} a metre, {:.1} across '{}' ({:.3} m), Courant number {}, where {what} was \
         measured to be {:.2} % off",
        chosen.density,
        chosen.density * chosen.size,
        chosen.body,
        chosen.size,
        chosen.courant,
        100.0 * chosen.error
    )
}

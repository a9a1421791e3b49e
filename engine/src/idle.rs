//! Keys that a scene writes and that do nothing in it: they are named, not refused, for a scene is often another one's copy.

use crate::elastic::Choice;
use crate::scene::{Object, Scene, Simulation, default_friction};
use crate::world::World;

/// A line for each.
pub(crate) fn notes(scene: &Scene, world: &World, choice: &Choice) -> Vec<String> {
    if world.bodies.is_empty() {
        return Vec::new();
    }
    let (set, usual) = (&scene.simulation, Simulation::default());
    let elastic = world.bodies.iter().any(|b| b.material.elastic());
    let (liquids, bodies) = ("no object is a liquid of SPH", "no object is elastic");
    let settings = [
        ("pressure", set.pressure != usual.pressure && !world.is_fluid(), liquids),
        ("viscosity", set.viscosity != usual.viscosity && !world.is_fluid(), liquids),
        ("particle_size", set.particle_size != usual.particle_size && !world.is_fluid(), liquids),
        ("shifting", set.shifting && !world.is_fluid(), liquids),
        ("elastic", set.elastic != usual.elastic && !elastic, bodies),
        ("stiffness_cap", set.stiffness_cap.is_some() && !elastic, bodies),
    ];
    let settings = settings.into_iter().filter(|(_, idle, _)| *idle);
    let settings = settings.map(|(key, _, why)| format!("`simulation.{key}` does nothing: {why}"));
    // Between bodies of MPM there is none; beside one on a grid of its own theirs counts.
    let rubs = choice.total_lagrangian || !choice.beside.is_empty();
    settings.chain(scene.objects.iter().flat_map(|object| of_object(object, rubs))).collect()
}

fn of_object(object: &Object, rubs: bool) -> Vec<String> {
    let still = object.material.is_none();
    let keys = [
        ("velocity", still && object.velocity != [0.0; 3]),
        ("angular_velocity", still && object.angular_velocity != [0.0; 3]),
        ("gravity", still && object.gravity.is_some()),
        ("pins", still && !object.pins.is_empty()),
        ("prestress", still && object.prestress == Some(true)),
        ("damping", still && object.damping != 0.0),
        ("friction", (still || !rubs) && object.friction != default_friction()),
    ];
    let why = match still {
        true => "it has no material and stands still",
        false => "it acts where bodies are on grids of their own, and here none is",
    };
    let line = |key| format!("`{key}` of '{}' does nothing: {why}", object.name);
    keys.into_iter().filter(|(_, idle)| *idle).map(|(key, _)| line(key)).collect()
}

//! Keys that a scene writes and that do nothing in it: they are named, not refused, for a scene is often another one's copy.

use physvideo_gpu::kernels;

use crate::elastic::Choice;
use crate::scene::{Collider, Field, Material, Object, Scene, Simulation, default_friction};
use crate::world::World;

/// A line for each.
pub(crate) fn notes(scene: &Scene, world: &World, choice: &Choice) -> Vec<String> {
    if world.bodies.is_empty() {
        return Vec::new();
    }
    let (set, usual) = (&scene.simulation, Simulation::default());
    let elastic = world.bodies.iter().any(|b| b.material.elastic());
    let (liquids, bodies) = ("no object is a liquid of SPH", "no object is elastic");
    let flows = |o: &Object| matches!(o.material, Some(Material::Sph { .. }));
    let (only, spaced) = (scene.objects.iter().all(flows), "every object is a liquid of SPH");
    let settings = [
        ("pressure", set.pressure != usual.pressure && !world.is_fluid(), liquids),
        ("viscosity", set.viscosity != usual.viscosity && !world.is_fluid(), liquids),
        ("particle_size", set.particle_size != usual.particle_size && !world.is_fluid(), liquids),
        ("shifting", set.shifting && !world.is_fluid(), liquids),
        ("grid_density", set.grid_density != usual.grid_density && only, spaced),
        ("particles_per_cell", set.particles_per_cell != usual.particles_per_cell && only, spaced),
        ("sleep", set.sleep != usual.sleep && world.is_fluid(), "it is for bodies of MPM"),
        ("elastic", set.elastic != usual.elastic && !elastic, bodies),
        ("stiffness_cap", set.stiffness_cap.is_some() && !elastic, bodies),
    ];
    let settings = settings.into_iter().filter(|(_, idle, _)| *idle);
    let settings = settings.map(|(key, _, why)| format!("`simulation.{key}` does nothing: {why}"));
    // Between bodies of MPM there is none; beside one on a grid of its own theirs counts.
    let rubs = choice.total_lagrangian || !choice.beside.is_empty();
    let objects = scene.objects.iter().flat_map(|object| of_object(object, rubs));
    let colliders = scene.colliders.iter().enumerate().flat_map(|(i, c)| of_collider(i, c, scene));
    let fields = scene.fields.iter().enumerate().filter_map(|(i, f)| of_field(i, f, scene));
    settings.chain(objects).chain(colliders).chain(fields).collect()
}

/// Takes from a world what its scene's late or aimless fields and late motions of obstacles would do to bounds of speeds and
/// energies; `ground`: the first obstacle is the ground.
pub(crate) fn silence(scene: &Scene, world: &mut World, ground: bool) {
    for (i, f) in scene.fields.iter().enumerate() {
        if of_field(i, f, scene).is_some() {
            world.fields[i] = kernels::Field::default();
        }
    }
    for (c, here) in scene.colliders.iter().zip(&mut world.colliders[usize::from(ground)..]) {
        if c.start >= over(scene) {
            (here.velocity, here.spin) = ([0.0; 4], [0.0; 4]);
        }
    }
}

/// When the last frame is [s]: the first is the start.
fn over(scene: &Scene) -> f32 {
    scene.output.frames.saturating_sub(1) as f32 / scene.output.fps
}

fn of_collider(index: usize, c: &Collider, scene: &Scene) -> Vec<String> {
    let moves = (c.velocity, c.angular_velocity) != ([0.0; 3], [0.0; 3]);
    let mut found = Vec::new();
    let mut tell =
        |keys: &str, idle: &str, why: String| found.push(format!("{keys} of collider[{index}] {idle}: {why}"));
    if c.sticky && c.friction != default_friction() {
        tell("`friction`", "does nothing", "it is `sticky`".into());
    }
    if !moves && (c.start != 0.0 || c.end < over(scene)) {
        tell("`start` and `end`", "do nothing", "they say when it moves, and it has no velocity".into());
    }
    if moves && c.start >= over(scene) {
        tell("`velocity` and `angular_velocity`", "do nothing", late(c.start, scene));
    }
    found
}

fn of_field(index: usize, f: &Field, scene: &Scene) -> Option<String> {
    let still = |o: &&Object| o.material.is_none();
    let named = |o: &&Object| f.objects.as_ref().is_none_or(|names| names.contains(&o.name));
    let why = match scene.objects.iter().filter(named).all(|o| still(&o)) {
        true if f.objects.as_ref().is_some_and(Vec::is_empty) => "it names no object".into(),
        true => "what it names has no material and stands still".into(),
        false if f.start >= over(scene) => late(f.start, scene),
        false => return None,
    };
    Some(format!("field[{index}] does nothing: {why}"))
}

fn late(start: f32, scene: &Scene) -> String {
    format!("it starts at {start} s, and the last frame is at {:.3} s", over(scene))
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

//! What starts inside something else: bodies in each other, liquids in obstacles. Runs once per scene on the CPU.

use std::collections::HashMap;

use crate::geometry::Particles;
use crate::scene::{Kind, Material, Object, Problem, Scene, Shape, Source};
use crate::walls::distance;
use crate::world::{Body, World, collider};

/// Two bodies, one of them of those that `counts` names, of which particles are closer than `reach` [m].
pub(crate) fn overlapping(bodies: &[Body], reach: f32, counts: impl Fn(usize) -> bool) -> Option<(usize, usize)> {
    let cell = |x: &[f32; 3]| x.map(|c| (c / reach).floor() as i64);
    let mut seen: HashMap<[i64; 3], Vec<(usize, [f32; 3])>> = HashMap::new();
    for (i, body) in bodies.iter().enumerate() {
        for x in &body.positions {
            let at = cell(x);
            let around = (0..27).map(|k| [at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1]);
            let close = |(j, y): &&(usize, [f32; 3])| {
                (counts(i) || counts(*j)) && (0..3).map(|a| (x[a] - y[a]).powi(2)).sum::<f32>() < reach * reach
            };
            // A body's own come later, so that all that is found is of others.
            if let Some((other, _)) = around.filter_map(|c| seen.get(&c)).flatten().find(close) {
                return Some((*other, i));
            }
        }
        body.positions.iter().for_each(|x| seen.entry(cell(x)).or_default().push((i, *x)));
    }
    None
}

/// Depth of a particle's centre in an obstacle from which it counts as inside, over the spacing: a lattice beside a wall has
/// its first layer half of it outside.
const INSIDE: f32 = 0.25;

/// Distance from an obstacle at which particles of a liquid may start, over the spacing: at half of it a particle and its image
/// are as far apart as any two. WCSPH threw one at a tenth off at 8 m/s; at 0.45 its compression is worth 1 m/s.
const ROOM: f32 = 0.45;

/// Leaves out the particles of a liquid of SPH that would start too near to an obstacle, in a shape that follows none; says how
/// many. Those that are deep in one are left for [`refuse`], and points are taken as they are given.
pub(crate) fn clear(
    scene: &Scene,
    object: &Object,
    ground: Option<f32>,
    size: f32,
    filled: &mut Particles,
) -> Option<String> {
    let given = matches!(object.source, Source::Points { .. }) || object.emitter.is_some();
    if given || !matches!(object.material, Some(Material::Sph { .. })) {
        return None;
    }
    let all: Vec<_> = scene.colliders.iter().map(collider).collect();
    let near = |x: &[f32; 3]| {
        let obstacles = all.iter().map(|c| distance(c, *x));
        let nearest = obstacles.chain(ground.map(|height| x[2] - height)).fold(f32::MAX, f32::min);
        nearest < ROOM * size && nearest >= -INSIDE * size
    };
    let keep: Vec<bool> = filled.positions.iter().map(|x| !near(x)).collect();
    let out = keep.iter().filter(|k| !**k).count();
    if out == 0 || out == keep.len() {
        return None;
    }
    let mut kept = keep.iter();
    filled.positions.retain(|_| kept.next() == Some(&true));
    let mut kept = keep.iter();
    filled.colors.retain(|_| kept.next() == Some(&true));
    let name = &object.name;
    Some(format!("{out} particles of '{name}' nearer to an obstacle than {ROOM} of their size are left out"))
}

/// Distance of particles of two liquids that overlap, over the spacing: of two lattices that lie in each other some are nearer
/// than √3/2, which is where they are centred, and boxes that only touch have none nearer than 1.
const CLOSE: f32 = 0.87;

/// Width of a room over a particle's size in which a liquid is at rest: at 0.95 it is, at 0.9 it moves at 2 to 7 m/s.
const FITS: f32 = 0.95;

/// Half extents of a room.
fn room(shape: &Shape) -> Option<[f32; 3]> {
    match shape {
        Shape::Room { half, .. } => Some(*half),
        _ => None,
    }
}

/// Liquids of SPH are thrown out of what they start in, obstacles and each other: such scenes are refused. `ground` is its
/// height [m], `object_of` the object of each body.
///
/// # Errors
/// The object that starts inside something, or a room too narrow for a particle.
pub(crate) fn refuse(scene: &Scene, world: &World, object_of: &[usize], ground: Option<f32>) -> Result<(), Problem> {
    if !world.is_fluid() {
        return Ok(());
    }
    let size = world.fluid.particle_size;
    let help = "a liquid of SPH is thrown out of what it starts in: move them apart";
    let fail = |body: usize, message: String| {
        let key = format!("object[{}].source", object_of[body]);
        Err(Problem::new(Kind::Conflict, key, message).help(help))
    };
    for (i, half) in scene.colliders.iter().enumerate().filter_map(|(i, c)| Some((i, room(&c.shape)?))) {
        let width = 2.0 * half.iter().copied().fold(f32::MAX, f32::min);
        if width < FITS * size {
            let key = format!("collider[{i}].shape.room.half");
            let message = format!("the room is {width:.4} m wide, and a particle of the liquid {size:.4} m");
            let help = "a liquid of SPH is thrown about where no particle fits: widen the room, or lower simulation.particle_size";
            return Err(Problem::new(Kind::Conflict, key, message).help(help));
        }
    }
    for (i, body) in world.bodies.iter().enumerate() {
        let deep = |distance: &dyn Fn(&[f32; 3]) -> f32| {
            let depths = body.positions.iter().map(|x| -distance(x)).filter(|depth| *depth > INSIDE * size);
            depths.fold((0, 0.0f32), |(count, most), depth| (count + 1, most.max(depth)))
        };
        let told = |name: String, (count, most): (usize, f32)| {
            format!(
                "{} inside {name}: {count} of its {} particles, up to {most:.3} m deep",
                begins(body),
                body.positions.len()
            )
        };
        if let Some(found) = ground.map(|height| deep(&|x| x[2] - height)).filter(|found| found.0 > 0) {
            return fail(i, told("the ground".into(), found));
        }
        for (index, obstacle) in scene.colliders.iter().map(collider).enumerate() {
            let found = deep(&|x| distance(&obstacle, *x));
            if found.0 > 0 {
                return fail(i, told(format!("collider[{index}]"), found));
            }
        }
    }
    shifted(scene, world)?;
    match overlapping(&world.bodies, CLOSE * size, |_| true) {
        Some((a, b)) => {
            let (a, at) = (called(&world.bodies[a]), called(&world.bodies[b]));
            fail(b, format!("{a} and {at} overlap, or are nearer to each other than {CLOSE} of a particle"))
        }
        None => Ok(()),
    }
}

fn begins(body: &Body) -> String {
    format!("{} {}", called(body), if body.emission.is_some() { "lies" } else { "starts" })
}

/// A body, or the nozzle that it waits in.
fn called(body: &Body) -> String {
    let nozzle = if body.emission.is_some() { "the nozzle of " } else { "" };
    format!("{nozzle}'{}'", body.name)
}

/// Share of a room that liquids have to fill where particles are shifted.
const FULL: f64 = 0.9;

/// Shifted particles boil at a free surface and go through walls there.
fn shifted(scene: &Scene, world: &World) -> Result<(), Problem> {
    if !world.fluid.shifting {
        return Ok(());
    }
    let at_rest = |o: &crate::scene::Object| o.emitter.is_none() && o.recycle.is_none();
    let rooms = scene.colliders.iter().filter_map(|c| match c.shape {
        Shape::Room { half, .. } => Some(half.iter().map(|h| 2.0 * f64::from(*h)).product::<f64>()),
        _ => None,
    });
    let room = rooms.fold(f64::INFINITY, f64::min);
    let liquid: f64 = world.bodies.iter().map(|b| b.positions.len() as f64 * f64::from(b.particle_volume)).sum();
    let filled = liquid / room;
    if filled >= FULL && scene.objects.iter().all(at_rest) && !world.is_tense() {
        return Ok(());
    }
    let message = format!(
        "shifted particles boil at a free surface: liquids without emitters, returns or tension have to fill nine tenths of a \
         room (`collider.shape.room`), and these fill {:.2} of one",
        filled
    );
    Err(Problem::new(Kind::Conflict, "simulation.shifting", message).help("fill the room, or remove this key"))
}

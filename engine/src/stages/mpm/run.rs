//! Stretches of particles with one material: each is a call of its own, compiled for that material alone, so that a
//! liquid pays for no singular values of the sand beside it.

use physvideo_gpu::Constants;

use super::Method;
use super::start::for_bodies;
use crate::world::{Body, World};

/// Stretches there can be (`Clock.runs`); the last takes what is left, whatever its materials.
pub(super) const MOST_RUNS: usize = 8;

/// Densities that differ by less count as one, to a liquid that looks at the mass around it.
const ALIKE: f32 = 0.01;
/// Where they differ, the share of J below which the mass around a liquid is taken to be something else's.
const PACKED: f64 = 0.9;

/// A stretch of the particle buffer.
#[derive(Clone, Debug)]
pub(super) struct Run {
    /// Its first particle.
    pub first: u32,
    /// How many.
    pub count: u32,
    /// Overrides of its call.
    pub constants: Constants,
}

/// Where the particles of a run that are worked on lie in the list of all that are.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Stretch {
    pub start: u32,
    pub count: u32,
}

/// The stretches of a world, in the order of its bodies, but those of `guests`, which move otherwise.
pub(super) fn runs(world: &World, method: Method, guests: &[bool]) -> Vec<Run> {
    let kind = |body: &Body| body.material.law().material;
    let own = |i: usize| guests.get(i) != Some(&true);
    let mut groups: Vec<std::ops::Range<usize>> = Vec::new();
    for (i, body) in world.bodies.iter().enumerate() {
        let full = groups.len() == MOST_RUNS;
        match groups.last_mut() {
            Some(last) if full || own(last.start) == own(i) && kind(&world.bodies[last.start]) == kind(body) => {
                last.end = i + 1;
            }
            _ => groups.push(i..i + 1),
        }
    }
    let all = groups.iter().filter(|g| own(g.start)).count() == 1;
    let mut densities = world.bodies.iter().zip(0..).filter(|(_, i)| own(*i)).map(|(b, _)| b.density);
    let one = densities.next().unwrap_or(1.0);
    let alike = densities.all(|d| (d / one - 1.0).abs() < ALIKE);
    // What starts anew does so after G2P, and then its cells are found.
    let locates = world.bodies.iter().all(|b| b.recycle.is_none());
    let mut first = 0;
    groups
        .into_iter()
        .filter_map(|group| {
            let (own, bodies) = (own(group.start), &world.bodies[group]);
            let count = bodies.iter().map(|b| b.positions.len() as u32).sum();
            let liquid = bodies.iter().all(|b| kind(b) == physvideo_gpu::kernels::family::material::LIQUID);
            let flag = |on: bool| if on { 1.0 } else { 0.0 };
            let constants = for_bodies(world, bodies, method)
                .with("ALL", flag(all))
                .with("LIQUID", flag(liquid))
                .with("LOCATES", flag(locates))
                .with("PACKED", if alike { 0.0 } else { PACKED });
            let run = Run { first, count, constants };
            first += count;
            own.then_some(run)
        })
        .collect()
}

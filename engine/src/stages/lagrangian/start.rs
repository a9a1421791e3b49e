//! What a solver starts with: what its kernels are specialised for, the particles.

use bytemuck::Zeroable;
use physvideo_gpu::Constants;
use physvideo_gpu::kernels::{self, Deformation, Member, Particle};

use crate::cap::Expected;
use crate::stages::solver::PINNED;
use crate::world::World;

/// Overrides: the members of each family that this world uses.
pub(super) fn constants(world: &World) -> Constants {
    let uses = |member: &Member| match member.family {
        "material" | "piola" => world.bodies.iter().any(|b| b.material.law().material == member.kind),
        "field" => world.fields.iter().any(|f| f.kind == member.kind),
        _ => world.colliders.iter().any(|c| c.shape == member.kind),
    };
    let flag = |on: bool| if on { 1.0 } else { 0.0 };
    kernels::MEMBERS.iter().fold(Constants::none(), |all, member| all.with(member.flag, flag(uses(member))))
}

/// Share of the waves' speed from which on what closes is a shock (`CALM` in WGSL).
const CALM: f64 = 0.25;

/// Whether any of the bodies that are its `own` may meet something so fast that a shock runs into it.
pub(super) fn shocked(world: &World, own: &[bool]) -> bool {
    let waves = world.bodies.iter().zip(own).filter(|(_, own)| **own).map(|(b, _)| f64::from(b.wave_speed()));
    Expected::of(world).speed() > CALM * waves.fold(f64::INFINITY, f64::min)
}

/// Particles at the start. Those that are held never change.
pub(super) fn initial_particles(world: &World) -> (Vec<Particle>, Vec<Deformation>) {
    let mut particles = Vec::new();
    let mut deformations = Vec::new();
    for (tag, body) in world.bodies.iter().enumerate() {
        for (i, x) in body.positions.iter().enumerate() {
            let held = if body.pinned.get(i) == Some(&true) { PINNED } else { 0 };
            let m = body.density * body.particle_volume;
            particles.push(Particle { x: *x, m, tag: tag as u32 | held, ..Particle::zeroed() });
            let unit = |a: usize, w: f32| std::array::from_fn(|i| if i == 3 { w } else { f32::from(u8::from(i == a)) });
            deformations.push(Deformation { f0: unit(0, body.particle_volume), f1: unit(1, 0.0), f2: unit(2, 0.0) });
        }
    }
    (particles, deformations)
}

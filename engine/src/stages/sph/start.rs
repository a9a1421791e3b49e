//! What the solver starts with: room for blocks, the members of families in use, the particles.

use std::ops::Range;

use bytemuck::Zeroable;
use physvideo_gpu::Constants;
use physvideo_gpu::kernels::family::shape;
use physvideo_gpu::kernels::{self, Collider, Deformation, Keep, Particle};

use crate::fluid::limits;
use crate::scene::Pressure;
use crate::stages::solver::PINNED;
use crate::stages::{cells, energy};
use crate::world::World;

/// Neighbours a particle has room for (`NEIGHBOURS` in WGSL).
pub(super) const NEIGHBOURS: u64 = 64;

/// Blocks there is room for: as many more as are touched at the start, neighbours included; never more than there are.
pub(super) fn slots(world: &World, grid: &kernels::Grid) -> u32 {
    let positions = world.bodies.iter().flat_map(|b| b.positions.iter().copied());
    let dense: u64 = grid.blocks.iter().map(|b| u64::from(*b)).product();
    (8 * cells::touched(grid, positions).0 + 64).min(dense) as u32
}

/// Overrides: the members of each family that this world uses, and the method.
pub(super) fn constants(world: &World) -> Constants {
    let solved = f64::from(u8::from(world.fluid.pressure == Pressure::Dfsph));
    let implicit = f64::from(u8::from(limits(world).implicit));
    let nozzles = f64::from(u8::from(world.bodies.iter().any(|b| b.emission.is_some())));
    let method = Constants::none().with("INCOMPRESSIBLE", solved).with("IMPLICIT", implicit).with("NOZZLES", nozzles);
    let recycles = f64::from(u8::from(world.bodies.iter().any(|b| b.recycle.is_some())));
    let moves = f64::from(u8::from(world.colliders.iter().any(energy::moves)));
    let shifts = f64::from(u8::from(world.fluid.shifting));
    let method =
        method.with("RECYCLES", recycles).with("COUNTS_WORK", nozzles.max(recycles).max(moves)).with("SHIFTS", shifts);
    kernels::MEMBERS.iter().fold(method, |all, member| {
        let used = match member.family {
            "material" => false,
            "field" => world.fields.iter().any(|f| f.kind == member.kind),
            _ => world.colliders.iter().any(|c| c.shape == member.kind),
        };
        all.with(member.flag, f64::from(u8::from(used)))
    })
}

/// The bodies as the kernels see them; that of an emitter says where its nozzle ends and how fast it blows.
pub(super) fn bodies(world: &World) -> Vec<kernels::Body> {
    let each = |b: &crate::world::Body| {
        let mut body = b.constants(world.gravity, world.dx);
        if let (Some(_), Some(v), Some(front)) = (&b.emission, b.velocities.first(), b.positions.first()) {
            body.p[1..].copy_from_slice(v);
            // All of them stand at the nozzle's end.
            body.lambda = v.iter().zip(front).map(|(v, x)| v * x).sum();
        }
        body
    };
    world.bodies.iter().map(each).collect()
}

/// From when to when obstacles move, and how fast where they are nearest to their liquid [s, m/s].
pub(super) fn motions(world: &World) -> Vec<(Range<f64>, f32)> {
    let size = |v: &[f32]| v.iter().map(|c| c * c).sum::<f32>().sqrt();
    let across: [f32; 3] = std::array::from_fn(|a| world.domain.1[a] - world.domain.0[a]);
    // A plane turns wherever there is liquid; of a plane `size` is the normal.
    let arm = |c: &Collider| if c.shape == shape::PLANE { size(&across) } else { size(&c.size[..3]) };
    let speed = |c: &Collider| size(&c.velocity[..3]) + size(&c.spin[..3]) * arm(c);
    let moving = world.colliders.iter().filter(|c| energy::moves(c));
    moving.map(|c| (f64::from(c.start)..f64::from(c.end), speed(c))).collect()
}

/// Before any search: no list holds, no velocity is known.
pub(super) fn no_lists() -> Keep {
    Keep { low: [u32::MAX; 3], ..Default::default() }
}

/// Largest speed at the start [m/s].
pub(super) fn fastest(world: &World) -> f32 {
    let speeds = world.bodies.iter().flat_map(|b| &b.velocities).map(|v| v.iter().map(|c| c * c).sum::<f32>());
    speeds.fold(0.0, f32::max).sqrt()
}

pub(super) fn initial_state(world: &World) -> (Vec<Particle>, Vec<Deformation>) {
    // Every particle has the volume h³: that is what number densities stand on.
    let volume = world.fluid.particle_size.powi(3);
    let mut particles = Vec::new();
    for (tag, body) in world.bodies.iter().enumerate() {
        for (i, x) in body.positions.iter().enumerate() {
            let pinned = body.pinned.get(i) == Some(&true);
            let mut p = Particle::zeroed();
            p.x = *x;
            p.v = if pinned { [0.0; 3] } else { body.velocities.get(i).copied().unwrap_or_default() };
            p.m = body.density * volume;
            p.tag = tag as u32 | if pinned { PINNED } else { 0 };
            particles.push(p);
        }
    }
    let mut rest = Deformation::zeroed();
    (rest.f0[0], rest.f1[1], rest.f2[2]) = (1.0, 1.0, 1.0);
    rest.f0[3] = volume;
    let deformations = vec![rest; particles.len()];
    (particles, deformations)
}

//! What a solver starts with: room for blocks and rows, what its kernels are specialised for, the particles.

use bytemuck::Zeroable;
use physvideo_gpu::Constants;
use physvideo_gpu::kernels::{self, Deformation, Member, Particle};

use super::{FLOWS, Method, P2g, PINNED};
use crate::scene::Material;
use crate::stages::cells;
use crate::stages::energy::moves;
use crate::world::{Body, World};

/// What there is room for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Room {
    /// Blocks that hold particles, and their upper neighbours.
    pub slots: u32,
    /// Rows of four cells that hold particles.
    pub rows: u32,
}

impl Room {
    /// Room for what is touched at the start and as many more, neighbours included; never more than there can be.
    pub fn new(grid: &kernels::Grid, (blocks, rows): (u64, u64), particles: u64) -> Self {
        let slots = (8 * blocks + 64).min(dense(grid));
        Self { slots: slots as u32, rows: (2 * rows + 64).min(particles.max(1)) as u32 }
    }

    /// With twice the room where it did not suffice.
    pub fn doubled(self, grid: &kernels::Grid, particles: u32, slots: bool, rows: bool) -> Self {
        let twice = |n: u32, yes: bool, most: u64| (u64::from(n) << u32::from(yes)).min(most) as u32;
        Self { slots: twice(self.slots, slots, dense(grid)), rows: twice(self.rows, rows, u64::from(particles)) }
    }

    /// Vectors between particles and nodes.
    pub fn given(self, p2g: P2g) -> u64 {
        match p2g {
            P2g::Cell => 54 * u64::from(self.rows),
            P2g::Fixed | P2g::Float => 216 * u64::from(self.slots),
        }
    }
}

fn dense(grid: &kernels::Grid) -> u64 {
    grid.blocks.iter().map(|b| u64::from(*b)).product()
}

/// The room a world starts with.
pub(super) fn room(world: &World, grid: &kernels::Grid) -> Room {
    let positions = || world.bodies.iter().flat_map(|b| b.positions.iter().copied());
    Room::new(grid, cells::touched(grid, positions()), positions().count() as u64)
}

/// Share of the lightest particle's mass below which a node is one at the rim.
const SPARSE: f32 = 1e-2;

/// Overrides: the members of each family that this world uses, and the gradient.
pub(super) fn constants(world: &World, method: Method) -> Constants {
    for_bodies(world, &world.bodies, method)
}

/// The same where only some of the bodies matter.
pub(super) fn for_bodies(world: &World, bodies: &[Body], method: Method) -> Constants {
    let uses = |member: &&Member| match member.family {
        "material" => bodies.iter().any(|b| b.material.law().material == member.kind),
        "field" => world.fields.iter().any(|f| f.kind == member.kind),
        _ => world.colliders.iter().any(|c| c.shape == member.kind),
    };
    let flag = |on: bool| if on { 1.0 } else { 0.0 };
    let lightest = world.bodies.iter().map(|b| b.density * b.particle_volume).fold(f32::MAX, f32::min);
    let start = Constants::none()
        .with("TRUE_GRADIENT", flag(method.true_gradient))
        .with("SPARSE", f64::from(SPARSE * lightest))
        .with(
            "COUNTS_WORK",
            flag(world.bodies.iter().any(|b| b.recycle.is_some()) || world.colliders.iter().any(moves)),
        );
    kernels::MEMBERS.iter().fold(start, |all, member| all.with(member.flag, flag(uses(&member))))
}

pub(super) fn initial_state(world: &World) -> (Vec<Particle>, Vec<Deformation>) {
    let mut particles = Vec::new();
    let mut deformations = Vec::new();
    for (tag, body) in world.bodies.iter().enumerate() {
        for (i, x) in body.positions.iter().enumerate() {
            let mut p = Particle::zeroed();
            p.x = *x;
            let pinned = body.pinned.get(i) == Some(&true);
            // What is held does not move, whatever the rest of its body does.
            p.v = if pinned { [0.0; 3] } else { body.velocities.get(i).copied().unwrap_or_default() };
            p.m = body.density * body.particle_volume;
            p.tag = tag as u32 | if pinned { PINNED } else { 0 } | if body.material.elastic() { 0 } else { FLOWS };
            particles.push(p);
            let mut d = Deformation::zeroed();
            // Of a liquid only J is kept.
            d.f0[0] = 1.0;
            if !matches!(body.material, Material::Liquid { .. }) {
                (d.f1[1], d.f2[2]) = (1.0, 1.0);
            }
            d.f0[3] = body.particle_volume;
            deformations.push(d);
        }
    }
    (particles, deformations)
}

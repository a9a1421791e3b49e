//! What is inside a body meets obstacles too where one could pass into its surface: that stretches around it until nothing
//! is left to push.

use physvideo_gpu::kernels::family::shape::BOX;
use physvideo_gpu::kernels::{Collider, ElasticCell, lagrangian};
use physvideo_gpu::{Buf, Gpu, GpuError};

use super::Lagrangian;
use crate::walls::width;
use crate::world::{Body, World};

/// Whether some obstacle could pass into the surface of one of the bodies that are its `own`: edges and corners of boxes, and
/// balls that are narrower than it is long.
pub(super) fn pierced(world: &World, own: &[bool]) -> bool {
    let long = world.bodies.iter().zip(own).filter(|(_, own)| **own).map(|(b, _)| length(b)).fold(0.0, f32::max);
    long > 0.0 && world.colliders.iter().any(|c| c.shape == BOX || width(c).is_some_and(|w| w < long))
}

/// Whether the surface of an obstacle bends somewhere: it is no plane, nor a room, whose walls are met one by one.
pub(super) fn curved(c: &Collider) -> bool {
    width(c).is_some()
}

/// The longest side of the box around a body [m].
pub(crate) fn length(body: &Body) -> f32 {
    let across = |a: usize| {
        let all = body.positions.iter().map(|x| x[a]);
        all.clone().fold(f32::MIN, f32::max) - all.fold(f32::MAX, f32::min)
    };
    (0..3).map(across).fold(0.0, f32::max)
}

/// The energy of that contact, a cell.
pub(super) struct Cores {
    energies: Buf<f32>,
    /// Body of each cell.
    bodies: Vec<u32>,
}

impl Cores {
    pub fn new(gpu: &Gpu, cells: &[ElasticCell]) -> Result<Self, GpuError> {
        let energies = gpu.alloc("run", "lagrangian/core_energies", cells.len() as u64)?;
        Ok(Self { energies, bodies: cells.iter().map(|c| c.mask >> 16).collect() })
    }

    /// What adds to the shares of the cells of `all`.
    pub fn call(&self, all: &Lagrangian) -> lagrangian::Core {
        let Lagrangian { cells, nodes, solids, colliders, shares, clock, sizes: immediates, .. } = *all;
        let super::State { u, v, .. } = all.state;
        let energies = self.energies;
        lagrangian::Core {
            cells,
            nodes,
            solids,
            u,
            v,
            colliders,
            shares_was: shares,
            shares,
            energies,
            clock,
            immediates,
        }
    }

    /// Energy of a body's contact [J].
    pub fn energy(&self, gpu: &Gpu, body: usize) -> Result<f64, GpuError> {
        let all = gpu.read(self.energies)?;
        Ok(all.iter().zip(&self.bodies).filter(|(_, b)| **b as usize == body).map(|(e, _)| f64::from(*e)).sum())
    }
}

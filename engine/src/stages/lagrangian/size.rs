//! How much memory a solver will take, before any is allocated.

use physvideo_gpu::kernels::{self, Deformation, Particle};

use super::facets::Facets;
use super::matter::Matter;
use super::pairs::Pairs;
use super::reference::Reference;
use super::{Lagrangian, core};
use crate::world::World;

impl Lagrangian<'_> {
    /// Bytes that [`Lagrangian::new`] will allocate, before any is made; 0 where it will refuse.
    pub fn bytes(world: &World) -> u64 {
        Self::bytes_of(world, &vec![true; world.bodies.len()])
    }

    /// The same of the bodies that are its `own`, beside another solver that has the particles if they are not all.
    pub fn bytes_of(world: &World, own: &[bool]) -> u64 {
        let Ok(r) = Reference::new(world, own) else { return 0 };
        let (nodes, cells, skins) = (r.nodes.len() as u64, r.cells.len() as u64, r.skins.len() as u64);
        let (hosted, several) = (own.contains(&false), own.iter().filter(|own| **own).count() > 1);
        let state = if hosted { 0 } else { size_of::<Particle>() + size_of::<Deformation>() };
        let each = (state + size_of::<kernels::Rest>() + 1) as u64;
        let node = (size_of::<kernels::ElasticNode>() + 4 * 16) as u64;
        let cell = (size_of::<kernels::ElasticCell>() + 27 * 16) as u64;
        let skin = (size_of::<kernels::Skin>() + (2 + 4) * 16) as u64;
        let facets = if several || hosted { Facets::new(world, &r, own).map_or(0, |f| f.list.len()) } else { 0 };
        let surfaces = if several { Pairs::bytes(facets) } else { 0 } + if hosted { Matter::bytes(facets) } else { 0 };
        let inside = if core::pierced(world, own) { 4 * cells } else { 0 };
        each * r.rests.len() as u64 + node * nodes + cell * cells + skin * skins + r.thin.bytes() + inside + surfaces
    }
}

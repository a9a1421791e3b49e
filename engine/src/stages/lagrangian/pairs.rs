//! Contact of bodies with each other: where their surfaces are, and what those that meet do to each other. One body
//! has none of this.

use physvideo_gpu::kernels::{self, Bounds, Clock, Facet, Patch, Surface, Tie, lagrangian};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Recording};

use super::State;
use super::facets::{Facets, GROUP};

/// Buffers of the surfaces.
pub(super) struct Pairs {
    facets: Buf<Facet>,
    patches: Buf<Patch>,
    bounds: Buf<Bounds>,
    ties: Buf<Tie>,
    saved: Buf<Tie>,
    /// Sizes of a call.
    pub sizes: Surface,
    /// Facets of each body.
    ranges: Vec<std::ops::Range<usize>>,
    constants: Constants,
}

/// What they are of: the bodies, where they have moved to, and where their contact pushes.
pub(super) struct Moved {
    pub cells: Buf<kernels::ElasticCell>,
    pub solids: Buf<kernels::Solid>,
    pub state: State,
    pub pushes: Buf<[f32; 4]>,
    pub clock: Buf<Clock>,
}

impl Pairs {
    /// Uploads the surfaces; `obstacles`: there are some, whose contact is worked out first.
    pub fn new(gpu: &Gpu, all: Facets, dx: f32, constants: &Constants, obstacles: bool) -> Result<Self, GpuError> {
        let count = all.list.len() as u64;
        Ok(Self {
            facets: gpu.upload("run", "lagrangian/facets", &all.list)?,
            patches: gpu.alloc("run", "lagrangian/patches", count)?,
            bounds: gpu.alloc("run", "lagrangian/bounds", count.div_ceil(GROUP as u64))?,
            ties: gpu.alloc("run", "lagrangian/ties", count)?,
            saved: gpu.alloc("run", "lagrangian/saved_ties", count)?,
            sizes: all.sizes(dx),
            constants: constants.clone().with("BESIDE", f64::from(u8::from(obstacles))),
            ranges: all.ranges,
        })
    }

    /// Bytes that [`Pairs::new`] allocates for so many facets.
    pub fn bytes(facets: usize) -> u64 {
        let each = size_of::<Facet>() + size_of::<Patch>() + 2 * size_of::<Tie>();
        (facets * each + facets / GROUP * size_of::<Bounds>()) as u64
    }

    /// Adds what bodies do to each other to the pushes of obstacles.
    pub fn record(&self, rec: &mut Recording, of: &Moved, groups: Groups) {
        let Self { facets, patches, bounds, ties, sizes: immediates, .. } = *self;
        let Moved { cells, solids, state: State { u, v, .. }, pushes, clock } = *of;
        let surface = lagrangian::Surface { cells, facets, solids, u, v, ties, patches, bounds, immediates };
        rec.call(&surface, &self.constants, groups);
        rec.call(&lagrangian::Meet { patches, bounds, ties, pushes, clock, immediates }, &self.constants, groups);
    }

    /// Keeps the state of all contacts, for [`Pairs::record_back`].
    pub fn record_save(&self, rec: &mut Recording) {
        rec.copy(self.ties, self.saved);
    }

    /// Returns to the state that was kept.
    pub fn record_back(&self, rec: &mut Recording) {
        rec.copy(self.saved, self.ties);
    }

    /// Energy of body `index` in its contacts with others, half of each [J].
    pub fn energy(&self, gpu: &Gpu, index: usize) -> Result<f64, GpuError> {
        let ties = gpu.read(self.ties)?;
        let own = self.ranges.get(index).cloned().unwrap_or_default();
        Ok(own.map(|i| f64::from(ties[i].energy)).sum())
    }
}

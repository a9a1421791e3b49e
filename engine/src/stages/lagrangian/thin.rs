//! Thin parts of a body. A particle is a box; where few of them lie on each other a point in each says little of bending, as
//! n layers of points have 1 − 1/n² of the second moment of their boxes. So thin boxes get two Gauss points an axis.

use std::collections::HashMap;

use physvideo_gpu::kernels::{ElasticCell, Place, ThinCell, lagrangian};
use physvideo_gpu::{Buf, Gpu, GpuError, Recording};

use super::Lagrangian;
use super::lattice::{At, moved};

/// Layers that are integrated box by box; with three the points miss a ninth of the second moment.
const LAYERS: i32 = 2;
/// Gauss points of a box, half a cell wide, from its middle [cells].
const GAUSS: f64 = 0.25 * 0.577_350_269_189_625_8;

/// Along which axes a body is thin at a particle, a bit an axis.
pub(super) fn axes(all: &HashMap<At, usize>, at: At) -> u32 {
    let along = |axis: usize, way: i32| {
        let step = |n: i32| moved(at, std::array::from_fn(|a| if a == axis { way * n } else { 0 }));
        (1..=LAYERS).take_while(|n| all.contains_key(&step(*n))).count() as i32
    };
    (0..3).filter(|a| 1 + along(*a, -1) + along(*a, 1) <= LAYERS).map(|a| 1 << a).sum()
}

/// Quadrature points of the box at a corner of a cell that is thin along `axes`.
pub(super) fn places(corner: u32, axes: u32) -> Vec<Place> {
    let share = 1.0 / f32::from(1u8 << axes.count_ones());
    let signs = (0..8u32).filter(|s| s & !axes == 0);
    let at = |sign: u32| {
        std::array::from_fn(|a| {
            let middle = if corner >> a & 1 == 1 { 0.25 } else { -0.25 };
            let off = if sign >> a & 1 == 1 { GAUSS } else { -GAUSS };
            (middle + if axes >> a & 1 == 1 { off } else { 0.0 }) as f32
        })
    };
    signs.map(|sign| Place { x: at(sign), share }).collect()
}

/// The thin parts of all bodies.
#[derive(Default)]
pub(super) struct Thin {
    pub cells: Vec<ThinCell>,
    pub places: Vec<Place>,
}

impl Thin {
    /// Takes the places of a cell, if it has any; kernels take four at a time.
    pub fn add(&mut self, cell: u32, places: Vec<Place>) {
        if places.is_empty() {
            return;
        }
        let first = self.places.len() as u32;
        // A box lies on one side of its cell's middle along each axis.
        let corner = |p: &Place| (0..3).map(|a| u32::from(p.x[a] > 0.0) << a).sum::<u32>();
        let points = places.iter().fold(0, |all, p| all | 1 << corner(p));
        self.places.extend(places);
        self.places.resize(self.places.len().next_multiple_of(4), Place::default());
        self.cells.push(ThinCell { cell, first, count: self.places.len() as u32 - first, points });
    }

    /// Bytes it will take on the device.
    pub fn bytes(&self) -> u64 {
        let cell = size_of::<ThinCell>() + size_of::<f32>();
        (cell * self.cells.len() + size_of::<Place>() * self.places.len()) as u64
    }
}

/// The same on the device.
pub(super) struct Thins {
    pub cells: Buf<ThinCell>,
    pub places: Buf<Place>,
    /// What each cell stores beside what its particles tell [J].
    energies: Buf<f32>,
    /// Body of each cell.
    bodies: Vec<usize>,
}

impl Thins {
    /// Uploads it, if there is any; `all` are the cells of the bodies.
    pub fn new(gpu: &Gpu, thin: &Thin, all: &[ElasticCell]) -> Result<Option<Self>, GpuError> {
        let cells = thin.cells.as_slice();
        if cells.is_empty() {
            return Ok(None);
        }
        Ok(Some(Self {
            cells: gpu.upload("run", "lagrangian/thins", cells)?,
            places: gpu.upload("run", "lagrangian/places", &thin.places)?,
            energies: gpu.alloc("run", "lagrangian/energies", cells.len() as u64)?,
            bodies: cells.iter().map(|c| (all[c.cell as usize].mask >> 16) as usize).collect(),
        }))
    }
}

impl Lagrangian<'_> {
    /// Energy of the thin parts of each body that its particles do not tell [J]: of n layers of points 1/n² of that of
    /// bending.
    pub(super) fn bends(&self) -> Result<Vec<f64>, GpuError> {
        let mut sums = vec![0.0; self.ranges.len()];
        let Some(thins) = &self.thins else { return Ok(sums) };
        let Self { cells, solids, bodies, sizes: immediates, .. } = *self;
        let bend = lagrangian::Bend {
            cells,
            solids,
            thins: thins.cells,
            places: thins.places,
            u: self.state.u,
            bodies,
            energies: thins.energies,
            immediates,
        };
        let mut rec = Recording::new("bend");
        rec.each(&bend, &self.constants, thins.bodies.len() as u64);
        self.gpu.run(&rec)?;
        for (energy, body) in self.gpu.read(thins.energies)?.into_iter().zip(&thins.bodies) {
            sums[*body] += f64::from(energy);
        }
        Ok(sums)
    }
}

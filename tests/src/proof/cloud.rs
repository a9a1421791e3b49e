//! Seeded particles in a grid that is different along each axis, so that mixed-up axes show. Knows no kernel.

use physvideo_gpu::kernels::{Deformation, Grid, MEMBERS, Particle};

use super::Ask;
use crate::random::Random;

/// Flags of a particle's tag (lib/particle.wgsl).
pub const PINNED: u32 = 0x4000_0000;
/// Taken out of the simulation.
pub const QUARANTINED: u32 = 0x8000_0000;
/// At rest: gives to the grid and takes nothing from it.
pub const ASLEEP: u32 = 0x1000_0000;
/// Beside what is asleep.
pub const WATCHED: u32 = 0x0200_0000;
/// Still in its nozzle.
pub const LED: u32 = 0x0400_0000;
/// Not emitted yet; comes with `QUARANTINED`.
pub const DORMANT: u32 = 0x0800_0000;
/// Of a material whose F is not that of its whole motion.
pub const FLOWS: u32 = 0x2000_0000;
/// Bodies particles belong to: one of each material, and one of a material there is not.
pub fn body_count() -> usize {
    MEMBERS.iter().filter(|m| m.family == "material").count() + 1
}

/// The grid of the proofs; its capacity is set by who uses it.
pub fn grid() -> Grid {
    Grid { origin: [-0.31, 0.12, 0.05], dx: 0.04, blocks: [5, 4, 3], capacity: 60, rows: 960, ..Default::default() }
}

/// Particles with all they carry.
#[derive(Clone, Debug)]
pub struct Cloud {
    /// In no order.
    pub particles: Vec<Particle>,
    /// Same index.
    pub deformations: Vec<Deformation>,
    /// Indices of particles whose values are not sound; their tags do not say so.
    pub poisoned: Vec<usize>,
}

impl Cloud {
    /// Most particles in a lump of 5³ cells across the borders of eight blocks, the rest anywhere in the grid.
    pub fn new(ask: Ask) -> Self {
        let mut random = Random::new(ask.seed);
        let mut cloud = Self { particles: Vec::new(), deformations: Vec::new(), poisoned: Vec::new() };
        for i in 0..ask.items {
            cloud.particles.push(particle(&mut random));
            cloud.deformations.push(deformation(&mut random));
            if ask.poison && i % 16 == 3 {
                cloud.poisoned.push(i);
            }
        }
        for (turn, i) in cloud.poisoned.iter().enumerate() {
            let p = &mut cloud.particles[*i];
            match turn % 8 {
                0 => p.x[1] = f32::NAN,
                1 => p.x[0] = f32::INFINITY,
                2 => p.v[2] = f32::NEG_INFINITY,
                3 => p.v[0] = -f32::NAN,
                4 => p.x[2] = 1e30,
                5 => p.x[0] = -3e38,
                6 => p.x[1] = 0.12 + 0.04 * 0.2,  // one node short of the lower border
                _ => p.x[2] = 0.05 + 0.04 * 10.6, // one node past the upper border
            }
        }
        cloud
    }

    /// Marks the poisoned particles as `cells/locate` does, and makes all they carry NaN.
    #[must_use]
    pub fn quarantined(mut self) -> Self {
        let nan = [f32::NAN; 4];
        for i in &self.poisoned {
            let p = &mut self.particles[*i];
            *p = Particle { x: [f32::NAN; 3], v: [f32::INFINITY; 3], c0: nan, c1: nan, c2: nan, s: nan, ..*p };
            p.tag |= QUARANTINED;
            self.deformations[*i] = Deformation { f0: nan, f1: nan, f2: nan };
        }
        self
    }
}

fn particle(random: &mut Random) -> Particle {
    let grid = grid();
    let lump = random.chance(0.8);
    let x = std::array::from_fn(|axis| {
        let cells = grid.blocks[axis] as usize * 4 - 2;
        let cell = if lump { 1 + axis + random.below(5) } else { random.below(cells) };
        // Clear of the cell's borders: which side of one rounding puts a particle is nobody's business.
        let place = cell as f32 + 0.5 + random.range(0.01, 0.99);
        grid.origin[axis] + grid.dx * place
    });
    let rows: [[f32; 3]; 3] = std::array::from_fn(|_| random.vector(5.0));
    let stress: [f32; 6] = std::array::from_fn(|_| random.range(-0.004, 0.004));
    let row = |i: usize| [rows[i][0], rows[i][1], rows[i][2], stress[i]];
    Particle {
        x,
        tag: random.below(body_count()) as u32
            | if random.chance(0.05) { PINNED } else { 0 }
            | if random.chance(0.2) { FLOWS } else { 0 }
            | if random.chance(0.05) { ASLEEP } else { 0 },
        v: random.vector(1.0),
        m: random.range(0.5e-3, 1.5e-3),
        c0: row(0),
        c1: row(1),
        c2: row(2),
        s: [stress[3], stress[4], stress[5], 0.0],
    }
}

fn deformation(random: &mut Random) -> Deformation {
    let mut columns: [[f32; 3]; 3] = std::array::from_fn(|_| random.vector(0.25));
    for (i, column) in columns.iter_mut().enumerate() {
        column[i] += 1.0;
    }
    let memory = random.range(-0.05, 0.15);
    let of = |i: usize, w: f32| [columns[i][0], columns[i][1], columns[i][2], w];
    Deformation { f0: of(0, random.range(0.5e-5, 1.5e-5)), f1: of(1, memory), f2: of(2, 0.0) }
}

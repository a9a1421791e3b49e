//! How much a scene may ask for, refused before it is made. Knows the sizes of things, and not what they are for.

use physvideo_gpu::kernels::{Deformation, Particle};

use crate::scene::{Kind, Material, Object, Problem};

/// Bodies the tag of a particle can name.
pub(crate) const MOST_BODIES: usize = 256;
/// Particles the kernels can number.
const MOST_PARTICLES: u64 = 1 << 28;
/// Device memory of a particle at the least: its state, twice, and its place in the sort.
const PARTICLE_BYTES: u64 = 2 * (size_of::<Particle>() + size_of::<Deformation>()) as u64 + 12;

/// Blocks of 4³ cells the sort can number.
const MOST_BLOCKS: f64 = 67_108_864.0;

/// Refuses a grid over `domain` [m] with cells of `dx` [m] that the sort could not number.
pub(crate) fn refuse_wide(domain: ([f32; 3], [f32; 3]), dx: f32) -> Result<(), Problem> {
    // Two blocks a side are added for the stencils; f64, because the numbers may be anything.
    let side = |a: usize| ((f64::from(domain.1[a]) - f64::from(domain.0[a])) / f64::from(dx) / 4.0).ceil() + 3.0;
    let blocks = side(0) * side(1) * side(2);
    if blocks <= MOST_BLOCKS {
        return Ok(());
    }
    let message = format!("the grid would have {blocks:.3e} blocks of 4 × 4 × 4 cells; at most {MOST_BLOCKS} fit");
    let help = "give a smaller simulation.domain or lower simulation.grid_density";
    Err(Problem::new(Kind::OutOfRange, "simulation.domain", message).help(help))
}

/// Counts particles before they are made, and refuses what could not be held.
pub(crate) struct Crowd {
    particles: u64,
    memory: u64,
}

impl Crowd {
    /// None yet, in a memory of so many bytes, where that is known.
    pub(crate) fn new(memory: Option<u64>) -> Self {
        Self { particles: 0, memory: memory.unwrap_or(u64::MAX) }
    }

    /// Adds the particles an object is about to have.
    pub(crate) fn add(&mut self, key: &str, object: &Object, count: u64) -> Result<(), Problem> {
        self.particles = self.particles.saturating_add(count);
        let need = self.particles.saturating_mul(PARTICLE_BYTES);
        let available = self.memory.min(MOST_PARTICLES * PARTICLE_BYTES);
        if need <= available {
            return Ok(());
        }
        let message = format!(
            "'{}' would have about {count} particles; with those before it they need {need} bytes, and {available} \
             bytes are available",
            object.name
        );
        let help = if matches!(object.material, Some(Material::Sph { .. })) {
            "raise simulation.particle_size or make the object smaller"
        } else {
            "lower simulation.grid_density or make the object smaller"
        };
        Err(Problem::new(Kind::Memory, key, message).help(help))
    }
}

//! How much a scene may ask for, refused before it is made. Knows the sizes of things, and not what they are for.

use physvideo_gpu::kernels::{Deformation, Particle};

use crate::scene::{Kind, Material, Object, Problem};
use crate::world::World;

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

/// Least substep as a share of a frame.
const LEAST_STEP: f32 = 1e-6;
/// Where damping makes steps so many times as short, it is what is wrong with a step too short.
const DEAR: f32 = 100.0;

/// Refuses steps so short that a frame of `length` [s] would take more than a million: time is kept in f32, and one below
/// its rounding would never reach the frame's end. `object_of` is the object of each body.
pub(crate) fn refuse_short(world: &World, object_of: &[usize], length: f32) -> Result<(), Problem> {
    let step = world.step();
    if world.bodies.is_empty() || step >= length * LEAST_STEP {
        return Ok(());
    }
    let damped = world.bodies.iter().position(|b| b.damping_cost(world.dx) > DEAR);
    let key = match (world.force_dt, damped) {
        (Some(_), _) => "simulation.force_dt".into(),
        (None, Some(body)) => format!("object[{}].damping", object_of[body]),
        (None, None) => "simulation".into(),
    };
    let message = format!(
        "a substep of {step:e} s is too short for frames of {length:e} s: at most a million fit. What is stiff, fast, light \
         or viscous shortens it, and so do fine grids, small Courant numbers and strong drag or damping"
    );
    Err(Problem::new(Kind::Conflict, key, message))
}

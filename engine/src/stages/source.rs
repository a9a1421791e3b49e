//! Particles that start anew: those that reach a region go back to their source. Knows the particles' layout, and no
//! solver.

use bytemuck::Zeroable;
use physvideo_gpu::kernels::{Clock, Deformation, Particle, Return, Tally, source};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Recording};

use super::cells::PARTICLE_GROUPS;
use crate::world::{Body, World, vec4};

/// What recycles the particles of a world.
#[derive(Debug)]
pub struct Recycling {
    returns: Buf<Return>,
    turns: Buf<u32>,
    tally: Buf<Tally>,
}

impl Recycling {
    /// Absent where no body asks for it; then nothing is compiled, allocated or dispatched.
    ///
    /// # Errors
    /// The device's refusal of a buffer.
    pub fn new(gpu: &Gpu, world: &World) -> Result<Option<Self>, GpuError> {
        if world.bodies.iter().all(|b| b.recycle.is_none()) {
            return Ok(None);
        }
        let each = |b: &Body| Return {
            gravity: vec4(b.gravity.unwrap_or(world.gravity)),
            ..b.recycle.unwrap_or(Return::zeroed())
        };
        let returns: Vec<Return> = world.bodies.iter().map(each).collect();
        let turns = vec![0; world.bodies.iter().map(|b| b.positions.len()).sum()];
        Ok(Some(Self {
            returns: gpu.upload("run", "source/returns", &returns)?,
            turns: gpu.upload("run", "source/turns", &turns)?,
            tally: gpu.alloc("run", "source/tally", 1)?,
        }))
    }

    /// Bytes that [`Recycling::new`] allocates.
    pub fn bytes(world: &World) -> u64 {
        let particles: usize = world.bodies.iter().map(|b| b.positions.len()).sum();
        let any = world.bodies.iter().any(|b| b.recycle.is_some());
        if any { (size_of::<Return>() * world.bodies.len() + 4 * particles + 4) as u64 } else { 0 }
    }

    /// Forgets the particles counted so far.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn reset(&self, gpu: &Gpu) -> Result<(), GpuError> {
        gpu.write(self.tally, 0, &[Tally::zeroed()])
    }

    /// Particles that started anew since the count was last forgotten.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn recycled(&self, gpu: &Gpu) -> Result<u32, GpuError> {
        Ok(gpu.read(self.tally)?[0].recycled)
    }

    /// Comes before the particles are sorted, in every substep: none may leave the grid unseen. `awake` are those
    /// that are worked on.
    pub fn record(
        &self,
        rec: &mut Recording,
        constants: &Constants,
        particles: Buf<Particle>,
        deformations: Buf<Deformation>,
        clock: Buf<Clock>,
        awake: Buf<u32>,
    ) {
        let Self { returns, turns, tally, .. } = *self;
        let call = source::Recycle { particles, deformations, turns, tally, clock, was: particles, returns, awake };
        rec.call(&call, constants, Groups::Indirect(clock.erase(), PARTICLE_GROUPS));
    }
}

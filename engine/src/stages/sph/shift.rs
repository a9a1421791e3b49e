//! Particle shifting: after each step particles go where they are less crowded, so that pressure bears no shear. Its
//! buffers exist only where a scene asks for it.

use physvideo_gpu::kernels::{self, Counts, Crowd, Debt, Grid, Keep, Local, sph};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Recording};

/// Buffers of shifting.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shift {
    spread: Buf<[f32; 4]>,
    /// What each particle owes, by number.
    pub debts: Buf<Debt>,
    /// The same when the frame began.
    pub saved: Buf<Debt>,
}

/// What it reads of a step.
pub(super) struct Step {
    pub places: Buf<[f32; 4]>,
    pub moves: Buf<[f32; 4]>,
    pub lists: Buf<u32>,
    pub crowds: Buf<Crowd>,
    pub locals: Buf<Local>,
    pub numbers: Buf<u32>,
    pub particles: Buf<[f32; 4]>,
    pub keep: Buf<Keep>,
    pub live: Buf<Counts>,
    pub clock: Buf<kernels::Clock>,
    pub grid: Grid,
    /// Workgroups over all particles.
    pub each: Groups,
}

impl Shift {
    /// Bytes of each particle.
    pub const BYTES: u64 = 3 * 16;

    pub fn new(gpu: &Gpu, count: u64) -> Result<Self, GpuError> {
        Ok(Self {
            spread: gpu.alloc("run", "sph/spread", count)?,
            debts: gpu.upload("run", "sph/debts", &vec![Debt::default(); count as usize])?,
            saved: gpu.alloc("run", "sph/debts-saved", count)?,
        })
    }

    /// Shifts the particles of a step that is done.
    pub fn record(&self, rec: &mut Recording, k: &Constants, step: &Step) {
        let Self { spread, debts, .. } = *self;
        let &Step { places, moves, lists, crowds, locals, numbers, particles, keep, live, clock, grid, each } = step;
        let immediates = grid;
        let sweep =
            sph::Spread { places, lists, crowds, locals, numbers, live, clock, spread, debts, keep, immediates };
        rec.call(&sweep, k, each);
        let adopt = sph::Adopt { spread, locals, moves, numbers, live, clock, places, particles, debts, keep };
        rec.call(&adopt, k, each);
    }
}

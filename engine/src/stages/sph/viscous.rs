//! Viscosity solved for: backward Euler by conjugate gradients that the device ends itself. Its buffers exist only where
//! the steps that explicit viscosity stands would be too short.

use physvideo_gpu::kernels::{self, Counts, Crowd, Descent, Grid, Local, sph};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Recording};

/// Most iterations of a step. Where all are needed the step's viscosity is up to 1,500 times what an explicit one stands
/// (½ √(12 · 1500 / 8) ln 2000 is 180); one that needs more is counted.
const MOST_ITERATIONS: u32 = 180;
/// What may be left over what there was, as root mean squares. Momentum is kept however much is; speeds agree with
/// explicit viscosity to half a percent with it (`tests/tests/sph/twist.rs`).
const TOLERANCE: f32 = 1e-3;

/// Buffers of a solve.
#[derive(Clone, Copy, Debug)]
pub(super) struct Viscous {
    lefts: Buf<[f32; 4]>,
    pulls: Buf<[f32; 4]>,
    aims: Buf<[f32; 4]>,
    draws: Buf<[f32; 4]>,
    shares: Buf<[f32; 2]>,
    partials: Buf<[f32; 2]>,
    /// How the solve goes.
    pub descent: Buf<Descent>,
}

/// What a solve reads of a step.
pub(super) struct Step {
    pub places: Buf<[f32; 4]>,
    pub flown: Buf<[f32; 4]>,
    pub numbers: Buf<u32>,
    pub lists: Buf<u32>,
    pub crowds: Buf<Crowd>,
    pub locals: Buf<Local>,
    pub live: Buf<Counts>,
    pub clock: Buf<kernels::Clock>,
    pub keys: Buf<u32>,
    pub awake: Buf<u32>,
    pub grid: Grid,
    /// Workgroups over all particles.
    pub each: Groups,
}

impl Viscous {
    /// Bytes of each particle.
    pub const BYTES: u64 = 4 * 16 + 8 + 1;

    pub fn new(gpu: &Gpu, count: u64) -> Result<Self, GpuError> {
        Ok(Self {
            lefts: gpu.alloc("run", "sph/lefts", count)?,
            pulls: gpu.alloc("run", "sph/pulls", count)?,
            aims: gpu.alloc("run", "sph/aims", count)?,
            draws: gpu.alloc("run", "sph/draws", count)?,
            shares: gpu.alloc("run", "sph/shares", count)?,
            partials: gpu.alloc("run", "sph/partials", count.div_ceil(64))?,
            descent: gpu.upload("run", "sph/descent", &[Descent::default()])?,
        })
    }

    /// Solves for the velocities in `flown`.
    pub fn record(&self, rec: &mut Recording, k: &Constants, step: &Step) {
        let Self { lefts, pulls, aims, draws, shares, partials, descent } = *self;
        let Step { places, flown, numbers, lists, crowds, locals, live, clock, keys, awake, grid: immediates, each } =
            *step;
        let once = Groups::Direct([1, 1, 1]);
        let pass = Groups::Indirect(descent.erase(), std::mem::offset_of!(Descent, groups) as u64);
        let resist = |motions, answers| sph::Resist {
            places,
            motions,
            lists,
            crowds,
            locals,
            live,
            clock,
            answers,
            shares,
            numbers,
            immediates,
        };
        let weigh = |opens: bool, last: bool| {
            let scale = kernels::Scale { opens: opens.into(), last: last.into(), tolerance: TOLERANCE };
            sph::Weigh { descent, clock, partials, immediates: scale }
        };
        rec.call(&weigh(true, false), k, once);
        rec.call(&resist(flown, lefts), &k.clone().with("OPENS", 1.0), each);
        for turn in 0..=MOST_ITERATIONS {
            rec.call(&resist(lefts, pulls), k, pass);
            rec.call(&sph::Total { keys, awake, clock, shares, partials }, k, pass);
            rec.call(&weigh(false, turn == MOST_ITERATIONS), k, once);
            rec.call(&sph::Descend { descent, live, pulls, lefts, aims, draws, flown }, k, pass);
        }
    }
}

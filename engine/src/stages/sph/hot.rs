//! What a step of SPH works with besides the particles, in the order of the cells.

use physvideo_gpu::kernels::{Crowd, Local};
use physvideo_gpu::{Buf, Gpu, GpuError};

use super::start::NEIGHBOURS;

/// What a step works with, in the order of the cells.
#[derive(Clone, Copy, Debug)]
pub(super) struct Hot {
    pub(super) places: Buf<[f32; 4]>,
    pub(super) moves: Buf<[f32; 4]>,
    pub(super) warm: Buf<[f32; 4]>,
    pub(super) numbers: Buf<u32>,
    pub(super) spots: Buf<u32>,
    pub(super) lists: Buf<u32>,
    pub(super) found: Buf<u32>,
    pub(super) crowds: Buf<Crowd>,
    pub(super) locals: Buf<Local>,
    pub(super) points: Buf<[f32; 4]>,
    pub(super) flows: Buf<[f32; 4]>,
    pub(super) flown: Buf<[f32; 4]>,
    pub(super) pushes: Buf<[f32; 4]>,
    pub(super) wants: Buf<u32>,
    pub(super) stirs: Buf<u32>,
    pub(super) lasts: Buf<u32>,
}

impl Hot {
    /// Bytes of each particle.
    pub(super) const BYTES: u64 = 7 * 16 + 6 * 4 + 4 * NEIGHBOURS + (size_of::<Crowd>() + size_of::<Local>()) as u64;

    pub(super) fn new(gpu: &Gpu, count: u64) -> Result<Self, GpuError> {
        Ok(Self {
            places: gpu.alloc("run", "sph/places", count)?,
            moves: gpu.alloc("run", "sph/moves", count)?,
            warm: gpu.alloc("run", "sph/warm", count)?,
            numbers: gpu.alloc("run", "sph/numbers", count)?,
            spots: gpu.alloc("run", "sph/spots", count)?,
            lists: gpu.alloc("run", "sph/lists", NEIGHBOURS * count)?,
            found: gpu.alloc("run", "sph/found", count)?,
            crowds: gpu.alloc("run", "sph/crowds", count)?,
            locals: gpu.alloc("run", "sph/locals", count)?,
            points: gpu.alloc("run", "sph/points", count)?,
            flows: gpu.alloc("run", "sph/flows", count)?,
            flown: gpu.alloc("run", "sph/flown", count)?,
            pushes: gpu.alloc("run", "sph/pushes", count)?,
            wants: gpu.alloc("run", "sph/wants", count)?,
            lasts: gpu.alloc("run", "sph/lasts", count)?,
            stirs: gpu.upload("run", "sph/stirs", &vec![0; count as usize])?,
        })
    }
}

//! The noise and the steps of the flow SDE on the device: known answers, the laws they are to have, what must not
//! depend on anything, what must stay.

mod functions;
mod noise;
mod pool;
mod steps;

use physvideo_gpu::kernels::{Buf, Mix, latent};
use physvideo_gpu::{Constants, Gpu, Recording};

/// Elements of a sample; every bound below follows from it.
pub const COUNT: usize = 1 << 20;
pub const SEED: [u32; 2] = [0x1234_5678, 9];

pub fn silent(gpu: &Gpu) {
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// What noise depends on.
#[derive(Clone, Copy)]
pub struct Noise {
    pub seed: [u32; 2],
    pub stream: u32,
    pub iteration: u32,
}

impl Noise {
    /// So many normals.
    pub fn sample(self, gpu: &Gpu, count: usize) -> Vec<f32> {
        let z = gpu.alloc::<f32>("noise", "z", count as u64).unwrap();
        let base = gpu.alloc::<f32>("noise", "base", count as u64).unwrap();
        let mut recording = Recording::new("noise");
        recording.each(&self.mix(z, base, z, 1.0), &Constants::none(), count as u64 / 4);
        gpu.run(&recording).unwrap();
        let out = gpu.read(z).unwrap();
        gpu.free_arena("noise");
        out
    }

    pub fn mix(self, z: Buf<f32>, base: Buf<f32>, mask: Buf<f32>, sigma: f32) -> latent::Mix {
        let Self { seed, stream, iteration } = self;
        let count = z.len() as u32;
        let immediates = Mix { seed, count, cells: mask.len() as u32, iteration, stream, sigma, ..Default::default() };
        latent::Mix { z: z.cast(), base: base.cast(), mask, immediates }
    }
}

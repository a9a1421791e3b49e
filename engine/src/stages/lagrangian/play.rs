//! What the solver offers to whoever plays a clip.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use physvideo_gpu::kernels::{Deformation, Particle};
use physvideo_gpu::{Buf, GpuError};

use super::Lagrangian;
use crate::stages::solver::{FrameStats, Measure, Solver};

impl Solver for Lagrangian<'_> {
    fn frame(&mut self, length: f32) -> Result<FrameStats, GpuError> {
        Lagrangian::frame(self, length)
    }

    fn measure(&self, index: usize) -> Result<Measure, GpuError> {
        Lagrangian::measure(self, index)
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn stop_when(&mut self, asked: Arc<AtomicBool>) {
        self.stop = Some(asked);
    }

    fn particles(&self) -> Buf<Particle> {
        self.particles
    }

    fn deformations(&self) -> Buf<Deformation> {
        self.deformations
    }

    fn deterministic(&self) -> bool {
        true
    }
}

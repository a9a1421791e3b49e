//! What the solver offers to whoever plays a clip.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use physvideo_gpu::kernels::{Deformation, Particle};
use physvideo_gpu::{Buf, GpuError};

use super::{Mpm, P2g};
use crate::stages::solver::{FrameStats, Measure, Nap, Solver};

impl Solver for Mpm<'_> {
    fn frame(&mut self, length: f32) -> Result<FrameStats, GpuError> {
        Mpm::frame(self, length)
    }

    fn measure(&self, index: usize) -> Result<Measure, GpuError> {
        Mpm::measure(self, index)
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn stop_when(&mut self, asked: Arc<AtomicBool>) {
        if let Some(guest) = &mut self.guest {
            guest.solver.stop_when(Arc::clone(&asked));
        }
        self.stop = Some(asked);
    }

    fn particles(&self) -> Buf<Particle> {
        self.particles
    }

    fn deformations(&self) -> Buf<Deformation> {
        self.deformations
    }

    fn left_out(&self) -> Vec<Vec<Nap>> {
        self.rest.naps(self.time)
    }

    fn deterministic(&self) -> bool {
        self.p2g != P2g::Float
    }
}

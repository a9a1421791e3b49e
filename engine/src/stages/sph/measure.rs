//! What is measured of the particles: sums over bodies, and the energy that a frame is held against.

use physvideo_gpu::kernels::{self, Particle, mpm};
use physvideo_gpu::{GpuError, Recording};

use super::Sph;
use crate::fluid::SOUND;
use crate::scene::Pressure;
use crate::stages::solver::{EVERY, Measure, QUARANTINED};

impl Sph<'_> {
    /// Sums over body `index`. A liquid's elastic energy is not counted.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn measure(&self, index: usize) -> Result<Measure, GpuError> {
        self.sums_over(index as u32)
    }

    /// Sums over one body, or over all.
    pub(super) fn sums_over(&self, body: u32) -> Result<Measure, GpuError> {
        let immediates = kernels::Only { body, count: self.count };
        let Self { particles, deformations, bodies, sums, .. } = *self;
        let mut rec = Recording::new("measure");
        let call = mpm::Measure { particles, deformations, bodies, sums, immediates };
        rec.each(&call, &self.constants, u64::from(self.count));
        self.gpu.run(&rec)?;
        Ok(Measure::of(&self.gpu.read(sums)?, self.fluid.particle_size))
    }

    /// Energies that bodies can move by: of a weakly compressible liquid also that of its compression,
    /// ∫ p/ρ² dρ = k/ρ₀ (s⁶/6 + 1/s − 7/6) per mass where s > 1, p = k (s⁷ − 1), k = c² ρ₀/7. Sums of kernels are out by
    /// half of that in a layer that is pressed against a wall, so it counts twice before a frame and not after it.
    pub(super) fn energies(&self) -> Result<Measure, GpuError> {
        let mut sums = self.sums_over(EVERY)?;
        if self.fluid.pressure == Pressure::Wcsph {
            let each = |p: &Particle| {
                let s = f64::from(p.s[0]).max(1.0);
                let there = if p.tag & QUARANTINED == 0 { f64::from(p.m) } else { 0.0 };
                there * 2.0 * f64::from(SOUND).powi(2) / 7.0 * (s.powi(6) / 6.0 + 1.0 / s - 7.0 / 6.0)
            };
            sums.elastic = self.gpu.read(self.particles)?.iter().map(each).sum();
        }
        Ok(sums)
    }
}

//! Sums over bodies: mass, motion, energy.

use physvideo_gpu::kernels::{self, mpm};
use physvideo_gpu::{GpuError, Recording};

use super::{Lagrangian, Lump};
use crate::stages::solver::Measure;

impl Lagrangian<'_> {
    /// Energy of all bodies: in motion and deformation (`kinetic`), and in gravity (`potential`).
    pub(super) fn energy(&self) -> Result<Measure, GpuError> {
        let (mut own, mut potential) = (0.0, 0.0);
        let u = self.gpu.read(self.state.u)?;
        for (index, range) in self.ranges.iter().enumerate() {
            let m = self.measure(index)?;
            own += m.kinetic + m.elastic;
            for (Lump { m, x, .. }, u) in self.lumps[range.clone()].iter().zip(&u[range.clone()]) {
                potential -= m * (0..3).map(|a| self.weights[index][a] * (x[a] + f64::from(u[a]))).sum::<f64>();
            }
        }
        Ok(Measure { kinetic: own, potential, ..Default::default() })
    }

    /// Sums over body `index`: motion from the nodes, in f64; energy (those of its contact and its thin parts included) and
    /// height from the particles.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn measure(&self, index: usize) -> Result<Measure, GpuError> {
        let immediates = kernels::Only { body: index as u32, count: self.sizes.points };
        let Self { particles, deformations, bodies, sums, .. } = *self;
        let mut rec = Recording::new("measure");
        let measure = mpm::Measure { particles, deformations, bodies, sums, immediates };
        rec.each(&measure, &self.constants, u64::from(self.sizes.points));
        self.gpu.run(&rec)?;
        let mut out = Measure::default();
        for s in self.gpu.read(sums)? {
            out.elastic += f64::from(s.elastic);
            out.height += f64::from(s.height);
            out.quarantined += s.lost as u32;
            out.speed = out.speed.max(f64::from(s.speed));
        }
        let (u, v) = (self.gpu.read(self.state.u)?, self.gpu.read(self.state.v)?);
        // Springs of contact belong to the body they push.
        let pushes = self.gpu.read(self.pushes)?;
        let skins = self.skin_ranges.get(index).cloned().unwrap_or_default();
        out.elastic += skins.map(|i| f64::from(pushes[4 * i][3])).sum::<f64>();
        out.elastic += self.ties(index)?;
        if let Some(cores) = &self.cores {
            out.elastic += cores.energy(self.gpu, index)?;
        }
        out.elastic += self.bends()?.get(index).copied().unwrap_or_default();
        let range = self.ranges.get(index).cloned().unwrap_or_default();
        out.mass = self.held.get(index).copied().unwrap_or_default();
        for i in range {
            let Lump { m, x, .. } = &self.lumps[i];
            let x: [f64; 3] = std::array::from_fn(|a| x[a] + f64::from(u[i][a]));
            let p: [f64; 3] = std::array::from_fn(|a| m * f64::from(v[i][a]));
            out.mass += m;
            for a in 0..3 {
                let (b, c) = ((a + 1) % 3, (a + 2) % 3);
                out.momentum[a] += p[a];
                out.spin[a] += x[b] * p[c] - x[c] * p[b];
                out.kinetic += 0.5 * p[a] * f64::from(v[i][a]);
            }
        }
        Ok(out)
    }
}

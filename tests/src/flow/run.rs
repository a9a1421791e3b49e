//! Algorithm 1 on the device with a velocity that is known, and the same in f64 on the host.

use physvideo::flow::{SdeRule, SdeStep, ab2, euler, heun_corrector};
use physvideo::scene::Solver;
use physvideo::stages::latent::{LatentSetup, LatentSpace, LatentStats, NoiseKey, Reading};
use physvideo_gpu::{Gpu, GpuError};

use super::noise::normals;

/// A network whose prediction is the velocity towards the data.
pub const PLAIN: Reading = Reading { scale: 1.0, latent: 0.0, guidance: None };

/// Velocities of many numbers at a noise level.
pub type Velocities<'a> = &'a dyn Fn(f64, &[f32], &mut [f32]);

/// A latent on the device whose velocity the host computes.
pub struct Lab<'gpu> {
    /// The latent.
    pub space: LatentSpace<'gpu>,
    v: Vec<f32>,
}

impl<'gpu> Lab<'gpu> {
    /// A latent of so many numbers, all updated, in cells of 16 channels.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn plain(gpu: &'gpu Gpu, elements: usize) -> Result<Self, GpuError> {
        Self::new(gpu, &LatentSetup { elements: elements as u64, cells: elements as u64 / 16, ..Default::default() })
    }

    /// A latent by its setup, all updated.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn new(gpu: &'gpu Gpu, setup: &LatentSetup) -> Result<Self, GpuError> {
        let space = LatentSpace::new(gpu, setup)?;
        space.update_where(&vec![1.0; setup.cells as usize])?;
        Ok(Self { space, v: vec![0.0; setup.elements as usize] })
    }

    /// Sets every number to `mean` with noise of this deviation.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn start(&mut self, mean: impl Fn(usize) -> f32, deviation: f64, key: NoiseKey) -> Result<(), GpuError> {
        let z: Vec<f32> = (0..self.v.len()).map(mean).collect();
        self.space.set(&z)?;
        self.v.fill(0.0);
        self.space.predict(&self.v, None)?;
        let noise = SdeStep { a: 0.0, b: 0.0, m: 0.0, s0: deviation, s1: 0.0 };
        self.space.sde_step(noise, 0, PLAIN, key).map(drop)
    }

    fn predict(&mut self, velocity: impl FnOnce(&[f32], &mut [f32])) -> Result<(), GpuError> {
        let (elements, v) = (self.v.len(), &mut self.v);
        let mut velocity = Some(velocity);
        let mut look = |z: &[f32]| {
            if let Some(velocity) = velocity.take() {
                velocity(&z[..elements], v);
            }
        };
        if self.space.view(&mut look)?.is_none() {
            look(&self.space.get()?);
        }
        self.space.predict(&self.v, None)
    }

    /// Iterations of the SDE with any coefficients and reading; `each` sees what the latent is like after each.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn chain(
        &mut self,
        steps: impl IntoIterator<Item = SdeStep>,
        reading: Reading,
        key: NoiseKey,
        velocity: &dyn Fn(&[f32], &mut [f32]),
        mut each: impl FnMut(LatentStats),
    ) -> Result<(), GpuError> {
        for (n, step) in steps.into_iter().enumerate() {
            each(self.iterate(n as u32, step, reading, key, velocity)?);
        }
        Ok(())
    }

    /// Iteration `n` of the SDE with any coefficients and reading.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn iterate(
        &mut self,
        n: u32,
        step: SdeStep,
        reading: Reading,
        key: NoiseKey,
        velocity: &dyn Fn(&[f32], &mut [f32]),
    ) -> Result<LatentStats, GpuError> {
        self.predict(velocity)?;
        self.space.sde_step(step, n, reading, key)
    }

    /// Iterations of a rule.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn sde(
        &mut self,
        rule: SdeRule,
        iterations: u32,
        key: NoiseKey,
        velocity: &dyn Fn(&[f32], &mut [f32]),
    ) -> Result<(), GpuError> {
        self.chain((0..iterations).map(|n| rule.step(n)), PLAIN, key, velocity, |_| {})
    }

    /// F or F⁻¹ along these noise levels, with the history begun anew.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn flow(&mut self, levels: &[f64], solver: Solver, velocity: Velocities) -> Result<(), GpuError> {
        for (i, pair) in levels.windows(2).enumerate() {
            let (from, to) = (pair[0], pair[1]);
            self.predict(|z, v| velocity(from, z, v))?;
            let step = match solver {
                Solver::Ab2 if i > 0 => ab2(levels[i - 1], from, to),
                _ => euler(from, to),
            };
            self.space.flow_step(step, PLAIN, solver != Solver::Euler)?;
            if solver == Solver::Heun {
                self.predict(|z, v| velocity(to, z, v))?;
                self.space.flow_step(heun_corrector(from, to), PLAIN, false)?;
            }
        }
        Ok(())
    }

    /// What the latent is like, from all its numbers.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn summary(&self) -> Result<Summary, GpuError> {
        Ok(Summary::of(&self.space.get()?))
    }
}

/// The SDE on the host in f64 with the device's noise; `weights` are those of each number.
pub fn host_sde(
    steps: impl IntoIterator<Item = SdeStep>,
    z: &mut [f64],
    key: NoiseKey,
    velocity: &dyn Fn(f64) -> f64,
    mu: f64,
    weights: &dyn Fn(usize) -> f64,
) {
    let mut noise = normals(key, 0, z.len());
    for (n, step) in steps.into_iter().enumerate() {
        let next = normals(key, n as u32 + 1, z.len());
        for (i, z) in z.iter_mut().enumerate() {
            let d = weights(i);
            let drift = step.a * *z + step.b * velocity(*z) + step.m * mu;
            *z += d * drift + d.sqrt() * (step.s0 * noise[i] + step.s1 * next[i]);
        }
        noise = next;
    }
}

/// F or F⁻¹ on the host in f64, from the rules themselves: Euler, Adams–Bashforth, the trapezium rule.
pub fn host_flow(levels: &[f64], solver: Solver, z: f64, velocity: &dyn Fn(f64, f64) -> f64) -> f64 {
    let slope = |sigma: f64, z: f64| -velocity(sigma, z);
    let (mut z, mut before) = (z, None);
    for pair in levels.windows(2) {
        let (h, f) = (pair[1] - pair[0], slope(pair[0], z));
        z = match (solver, before) {
            (Solver::Ab2, Some((earlier, g))) => {
                let r: f64 = h / (2.0 * earlier);
                z + h * ((1.0 + r) * f - r * g)
            }
            (Solver::Heun, _) => z + 0.5 * h * (f + slope(pair[1], z + h * f)),
            _ => z + h * f,
        };
        before = Some((h, f));
    }
    z
}

/// Moments of many numbers, with their standard errors.
#[derive(Clone, Copy, Debug)]
pub struct Summary {
    /// How many.
    pub count: f64,
    /// Mean.
    pub mean: f64,
    /// Variance.
    pub variance: f64,
    /// Share above 0.
    pub upper: f64,
    fourth: f64,
}

impl Summary {
    /// Of these numbers.
    pub fn of(z: &[f32]) -> Self {
        let threads = std::thread::available_parallelism().map_or(1, usize::from).min(8);
        let each = z.len().div_ceil(threads).max(1);
        // About a number near the mean, so that the sums lose nothing.
        let near = z.iter().step_by(z.len().div_ceil(4096)).map(|z| f64::from(*z)).sum::<f64>()
            / z.len().div_ceil(z.len().div_ceil(4096)) as f64;
        let sums = |z: &[f32]| {
            let (mut s, mut above) = ([0f64; 4], 0u64);
            for z in z {
                let x = f64::from(*z) - near;
                let q = x * x;
                s[0] += x;
                s[1] += q;
                s[2] += q * x;
                s[3] += q * q;
                above += u64::from(*z > 0.0);
            }
            (s, above)
        };
        let parts: Vec<_> = std::thread::scope(|scope| {
            let runs: Vec<_> = z.chunks(each).map(|z| scope.spawn(move || sums(z))).collect();
            runs.into_iter().map(|r| r.join().expect("sums do not panic")).collect()
        });
        let n = z.len() as f64;
        let [a, b, c, d] = std::array::from_fn(|k| parts.iter().map(|p| p.0[k]).sum::<f64>() / n);
        let upper = parts.iter().map(|p| p.1).sum::<u64>() as f64 / n;
        let fourth = d - 4.0 * a * c + 6.0 * a * a * b - 3.0 * a.powi(4);
        Self { count: n, mean: near + a, variance: b - a * a, upper, fourth }
    }

    /// Standard error of the mean.
    pub fn mean_error(&self) -> f64 {
        (self.variance / self.count).sqrt()
    }

    /// Standard error of the variance.
    pub fn variance_error(&self) -> f64 {
        ((self.fourth - self.variance.powi(2)).max(0.0) / self.count).sqrt()
    }

    /// Standard error of the share above 0.
    pub fn upper_error(&self) -> f64 {
        (self.upper * (1.0 - self.upper) / self.count).sqrt()
    }

    /// Root of the mean square.
    pub fn rms(&self) -> f64 {
        (self.variance + self.mean * self.mean).sqrt()
    }
}

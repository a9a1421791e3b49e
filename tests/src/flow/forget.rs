//! Many point modes in a high dimension, to see how long a chain remembers the mode it started at. Only the span of
//! the modes decides, so a sample is as many numbers as there are modes: coordinates in that span, in which random
//! modes of N(0, I_d) are the rows of a triangle (Bartlett 1933).

use physvideo::stages::latent::NoiseKey;

use super::data::in_parts;
use super::noise::normals;

/// Modes, and so numbers of a sample.
pub const MODES: usize = 64;

/// Sets of modes, and how many samples belong to each.
pub struct Modes {
    /// (1 − τ)/τ times the coordinates of each set's modes.
    sets: Vec<Vec<f32>>,
    samples: usize,
    tau: f64,
}

impl Modes {
    /// Sets of 64 modes from N(0, I_d), each with `samples` samples of the chain.
    pub fn new(dimension: f64, tau: f64, sets: usize, samples: usize, seed: u64) -> Self {
        let scale = (1.0 - tau) / tau;
        let one = |set: usize| {
            let numbers = normals(NoiseKey { seed, stream: set as u32 }, 0, MODES * MODES);
            let mut rows = vec![0f32; MODES * MODES];
            for i in 0..MODES {
                for j in 0..i {
                    rows[i * MODES + j] = (scale * numbers[i * MODES + j]) as f32;
                }
                // Length of a Gaussian vector of d − i numbers, by Wilson and Hilferty (1931).
                let (k, x) = (dimension - i as f64, numbers[i * MODES + i]);
                let third = 1.0 - 2.0 / (9.0 * k) + x * (2.0 / (9.0 * k)).sqrt();
                rows[i * MODES + i] = (scale * (k * third.powi(3)).sqrt()) as f32;
            }
            rows
        };
        Self { sets: (0..sets).map(one).collect(), samples, tau }
    }

    /// Numbers of all samples.
    pub fn elements(&self) -> usize {
        self.sets.len() * self.samples * MODES
    }

    /// The mode that a sample of a set starts at.
    fn start(sample: usize) -> usize {
        sample % MODES
    }

    fn of(&self, sample: usize) -> &[f32] {
        &self.sets[sample / self.samples]
    }

    /// (1 − τ) times the mode of each sample, to which noise of deviation τ is added.
    pub fn centers(&self) -> Vec<f32> {
        let samples = 0..self.sets.len() * self.samples;
        samples.flat_map(|s| self.row(s).iter().map(|u| (self.tau * f64::from(*u)) as f32)).collect()
    }

    fn row(&self, sample: usize) -> &[f32] {
        let mode = Self::start(sample);
        &self.of(sample)[mode * MODES..(mode + 1) * MODES]
    }

    /// Logarithms of the shares of the modes, but for a constant.
    fn logs(modes: &[f32], y: &[f32; MODES]) -> [f32; MODES] {
        std::array::from_fn(|k| {
            let u = &modes[k * MODES..k * MODES + k + 1];
            u.iter().zip(y).map(|(u, y)| u * (y - 0.5 * u)).sum()
        })
    }

    /// v = (x̂₀ − z)/τ with x̂₀ the posterior mean of the modes.
    pub fn velocity(&self, z: &[f32], v: &mut [f32]) {
        let (inverse, rest) = ((1.0 / self.tau) as f32, (1.0 / (1.0 - self.tau)) as f32);
        let group = self.samples * MODES;
        for ((z, v), modes) in z.chunks_exact(group).zip(v.chunks_exact_mut(group)).zip(&self.sets) {
            in_parts(z, v, |z, v| {
                for (z, v) in z.chunks_exact(MODES).zip(v.chunks_exact_mut(MODES)) {
                    let y: [f32; MODES] = std::array::from_fn(|i| z[i] * inverse);
                    let logs = Self::logs(modes, &y);
                    let top = logs.iter().fold(f32::MIN, |a, b| a.max(*b));
                    let mut mean = [0f32; MODES];
                    let mut sum = 0.0;
                    for (k, log) in logs.iter().enumerate() {
                        let share = (log - top).exp();
                        if share > 1e-9 {
                            sum += share;
                            mean.iter_mut().zip(&modes[k * MODES..=k * MODES + k]).for_each(|(m, u)| *m += share * u);
                        }
                    }
                    v.iter_mut().zip(mean).zip(y).for_each(|((v, m), y)| *v = m / sum * rest - y);
                }
            });
        }
    }

    /// Share of the samples that are nearest to the mode they started at.
    pub fn remembered(&self, z: &[f32]) -> f64 {
        let inverse = (1.0 / self.tau) as f32;
        let nearest = |(sample, z): &(usize, &[f32])| {
            let y: [f32; MODES] = std::array::from_fn(|i| z[i] * inverse);
            let logs = Self::logs(self.of(*sample), &y);
            (0..MODES).max_by(|a, b| logs[*a].total_cmp(&logs[*b])) == Some(Self::start(*sample))
        };
        let kept = z.chunks_exact(MODES).enumerate().filter(nearest).count();
        kept as f64 / (z.len() / MODES) as f64
    }
}

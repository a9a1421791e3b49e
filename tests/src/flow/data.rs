//! Laws of clean data along one number, with the exact velocity towards the data at every noise level. Written from
//! z = (1 − σ) x₀ + σ ε alone; knows no integrator.

/// A part of a law: a Gaussian, or a point where `deviation` is 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mode {
    /// Share of the whole.
    pub weight: f64,
    /// Mean of the clean data.
    pub mean: f64,
    /// Standard deviation of the clean data.
    pub deviation: f64,
}

/// A law of clean data: Gaussians and points with weights.
#[derive(Clone, Debug, PartialEq)]
pub struct Data(pub Vec<Mode>);

impl Data {
    /// N(mean, deviation²).
    pub fn gaussian(mean: f64, deviation: f64) -> Self {
        Self(vec![Mode { weight: 1.0, mean, deviation }])
    }

    /// A single point.
    pub fn point(mean: f64) -> Self {
        Self::gaussian(mean, 0.0)
    }

    /// Two points whose marginal at noise level `sigma` has its modes' means at ± `reach` σ; `upper` is the weight of
    /// the one above.
    pub fn two_points(sigma: f64, reach: f64, upper: f64) -> Self {
        let mean = reach * sigma / (1.0 - sigma);
        Self(vec![
            Mode { weight: 1.0 - upper, mean: -mean, deviation: 0.0 },
            Mode { weight: upper, mean, deviation: 0.0 },
        ])
    }

    /// The parts of the marginal at noise level `sigma`: weight, mean, variance.
    pub fn marginal(&self, sigma: f64) -> impl Iterator<Item = (f64, f64, f64)> {
        let rest = 1.0 - sigma;
        self.0.iter().map(move |m| (m.weight, rest * m.mean, (rest * m.deviation).powi(2) + sigma * sigma))
    }

    /// Mean of the marginal.
    pub fn mean(&self, sigma: f64) -> f64 {
        self.marginal(sigma).map(|(w, m, _)| w * m).sum()
    }

    /// Variance of the marginal.
    pub fn variance(&self, sigma: f64) -> f64 {
        self.marginal(sigma).map(|(w, m, s)| w * (m * m + s)).sum::<f64>() - self.mean(sigma).powi(2)
    }

    /// Density of the marginal.
    pub fn density(&self, z: f64, sigma: f64) -> f64 {
        self.marginal(sigma).map(|(w, m, s)| w * normal(z, m, s)).sum()
    }

    /// Score of the marginal, ∇ log p, by its own derivative.
    pub fn score(&self, z: f64, sigma: f64) -> f64 {
        self.shares(z, sigma).zip(self.marginal(sigma)).map(|(r, (_, m, s))| r * (m - z) / s).sum()
    }

    /// E[x₀ − ε | z], the velocity towards the data.
    pub fn velocity(&self, z: f64, sigma: f64) -> f64 {
        let rest = 1.0 - sigma;
        self.shares(z, sigma)
            .zip(&self.0)
            .map(|(r, mode)| {
                let s = (rest * mode.deviation).powi(2) + sigma * sigma;
                let off = z - rest * mode.mean;
                let clean = mode.mean + rest * mode.deviation.powi(2) * off / s;
                let noise = sigma * off / s;
                r * (clean - noise)
            })
            .sum()
    }

    /// Posterior share of each part, without overflow far away.
    fn shares(&self, z: f64, sigma: f64) -> impl Iterator<Item = f64> {
        let logs: Vec<f64> =
            self.marginal(sigma).map(|(w, m, s)| w.ln() - 0.5 * s.ln() - 0.5 * (z - m).powi(2) / s).collect();
        let top = logs.iter().fold(f64::NEG_INFINITY, |a, b| a.max(*b));
        let sum: f64 = logs.iter().map(|l| (l - top).exp()).sum();
        logs.into_iter().map(move |l| (l - top).exp() / sum)
    }

    /// The velocity at a noise level as a function of f32, for many numbers: one or two parts.
    ///
    /// # Panics
    /// With more than two parts.
    pub fn fast(&self, sigma: f64) -> Fast {
        let rest = 1.0 - sigma;
        let line = |m: &Mode| {
            let s = (rest * m.deviation).powi(2) + sigma * sigma;
            let slope = (rest * m.deviation.powi(2) - sigma) / s;
            ((m.mean - slope * rest * m.mean) as f32, slope as f32)
        };
        assert!(matches!(self.0.len(), 1 | 2), "one or two parts");
        let (first, last) = (&self.0[0], &self.0[self.0.len() - 1]);
        let parts: Vec<_> = self.marginal(sigma).collect();
        let ((w0, m0, s0), (w1, m1, s1)) = (parts[0], parts[parts.len() - 1]);
        // ln of (share of the last / share of the first) as a polynomial of z.
        let odds = [
            (w1 / w0).ln() - 0.5 * (s1 / s0).ln() + 0.5 * (m0 * m0 / s0 - m1 * m1 / s1),
            m1 / s1 - m0 / s0,
            0.5 / s0 - 0.5 / s1,
        ];
        Fast { first: line(first), last: line(last), odds: (self.0.len() == 2).then(|| odds.map(|c| c as f32)) }
    }
}

/// Velocity of a law at one noise level in f32.
#[derive(Clone, Copy, Debug)]
pub struct Fast {
    first: (f32, f32),
    last: (f32, f32),
    odds: Option<[f32; 3]>,
}

impl Fast {
    /// Velocities of many numbers, on all cores.
    pub fn fill(&self, z: &[f32], v: &mut [f32]) {
        in_parts(z, v, |z, v| self.fill_here(z, v));
    }

    fn fill_here(&self, z: &[f32], v: &mut [f32]) {
        let ((c0, k0), (c1, k1)) = (self.first, self.last);
        match self.odds {
            None => z.iter().zip(v).for_each(|(z, v)| *v = c0 + k0 * z),
            Some([a, b, c]) => z.iter().zip(v).for_each(|(z, v)| {
                let share = 1.0 / (1.0 + (-(a + z * (b + z * c))).exp());
                let (low, high) = (c0 + k0 * z, c1 + k1 * z);
                *v = low + share * (high - low);
            }),
        }
    }
}

/// Works on slices of both on all cores.
pub fn in_parts(from: &[f32], to: &mut [f32], work: impl Fn(&[f32], &mut [f32]) + Sync) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from).min(8);
    let each = from.len().div_ceil(threads).max(4096);
    std::thread::scope(|scope| {
        for (from, to) in from.chunks(each).zip(to.chunks_mut(each)) {
            let work = &work;
            scope.spawn(move || work(from, to));
        }
    });
}

/// Density of N(mean, variance).
pub fn normal(z: f64, mean: f64, variance: f64) -> f64 {
    (-0.5 * (z - mean).powi(2) / variance).exp() / (std::f64::consts::TAU * variance).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAU: f64 = 28.0 / 29.0;

    fn laws() -> Vec<Data> {
        let three = [(0.2, -1.0, 0.5), (0.5, 0.3, 2.0), (0.3, 4.0, 0.0)];
        let three = three.map(|(weight, mean, deviation)| Mode { weight, mean, deviation });
        vec![Data::gaussian(1.0, 0.7), Data::point(-2.0), Data::two_points(TAU, 1.5, 0.3), Data(three.to_vec())]
    }

    /// The score by the parts, by the velocity (−z/σ + (1 − σ)/σ v) and by the density's difference quotient agree.
    #[test]
    fn velocity_score_and_density_agree() {
        for data in laws() {
            for sigma in [0.3, 0.8, TAU] {
                for z in [-3.0, -0.4, 0.0, 0.9, 2.5] {
                    let score = data.score(z, sigma);
                    let by_velocity = -z / sigma + (1.0 - sigma) / sigma * data.velocity(z, sigma);
                    let h = 1e-5;
                    let log = |z: f64| data.density(z, sigma).ln();
                    let quotient = (log(z + h) - log(z - h)) / (2.0 * h);
                    assert!((score - by_velocity).abs() < 1e-11 * (1.0 + score.abs()), "{score} {by_velocity}");
                    // Far from every part the density itself is 0 in f64.
                    let seen = !quotient.is_finite() || (score - quotient).abs() < 1e-6 * (1.0 + score.abs());
                    assert!(seen, "{score} {quotient}");
                }
            }
        }
    }

    #[test]
    fn the_fast_velocity_is_the_velocity() {
        for data in laws().iter().take(3) {
            let z: Vec<f32> = (0..200).map(|i| 0.05 * i as f32 - 5.0).collect();
            let mut v = vec![0.0; z.len()];
            data.fast(TAU).fill(&z, &mut v);
            for (z, v) in z.iter().zip(v) {
                let want = data.velocity(f64::from(*z), TAU);
                // f32 of a share times the distance of the modes.
                let scale = 1.0 + data.0.iter().fold(0.0, |a: f64, m| a.max(m.mean.abs()));
                assert!((f64::from(v) - want).abs() < 1e-5 * scale, "{data:?} at {z}: {v} {want}");
            }
        }
    }
}

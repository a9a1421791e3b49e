//! The law of a chain on one number by quadrature: no noise is drawn, so errors of a tenth of a thousandth are seen.
//! On a grid whose spacing is a quarter of the noise of a step or less the trapezium rule is exact to rounding.

use physvideo::flow::{SdeRule, SdeStep};

use super::data::{Data, normal};

/// A density at the points −`REACH` … `REACH`.
#[derive(Clone, Debug)]
pub struct Law(Vec<f64>);

const REACH: f64 = 12.0;
/// Points on each side of 0.
const HALF: usize = 240;
const POINTS: usize = 2 * HALF + 1;
const SPACING: f64 = REACH / HALF as f64;

fn place(i: usize) -> f64 {
    (i as f64 - HALF as f64) * SPACING
}

impl Law {
    /// A density that is known.
    pub fn new(density: impl Fn(f64) -> f64) -> Self {
        Self((0..POINTS).map(|i| density(place(i))).collect())
    }

    /// The marginal of data.
    pub fn marginal(data: &Data, tau: f64) -> Self {
        Self::new(|z| data.density(z, tau))
    }

    fn integral(&self, of: impl Fn(f64) -> f64) -> f64 {
        SPACING * self.0.iter().enumerate().map(|(i, p)| p * of(place(i))).sum::<f64>()
    }

    /// Probability of everything; 1 but for what left the grid.
    pub fn mass(&self) -> f64 {
        self.integral(|_| 1.0)
    }

    /// Mean.
    pub fn mean(&self) -> f64 {
        self.integral(|z| z)
    }

    /// Variance.
    pub fn variance(&self) -> f64 {
        self.integral(|z| z * z) - self.mean().powi(2)
    }

    /// Probability of positive numbers, with the first correction of Euler and Maclaurin at 0.
    pub fn upper(&self) -> f64 {
        let p = &self.0;
        let slope = (p[HALF + 1] - p[HALF - 1]) / (2.0 * SPACING);
        SPACING * (0.5 * p[HALF] + p[HALF + 1..].iter().sum::<f64>()) + SPACING * SPACING / 12.0 * slope
    }

    fn blurred(&self, deviation: f64) -> Self {
        if deviation == 0.0 {
            return self.clone();
        }
        let kernel: Vec<f64> = (0..POINTS).map(|i| normal(i as f64 * SPACING, 0.0, deviation * deviation)).collect();
        let at = |i: usize| self.0.iter().enumerate().map(|(j, p)| p * kernel[i.abs_diff(j)]).sum::<f64>();
        Self((0..POINTS).map(|i| SPACING * at(i)).collect())
    }
}

/// A chain as matrices over the grid. With noise that neighbours share, z = x + s₁ ε of the next iteration, and x is
/// the Markov chain x' = g(x + s₁ ε) + s₀ ε.
pub struct Transfer {
    first: Vec<f64>,
    later: Option<Vec<f64>>,
    shared: f64,
}

impl Transfer {
    /// The chain of a rule on data.
    pub fn new(rule: SdeRule, data: &Data) -> Self {
        let drift = |step: SdeStep, z: f64| (1.0 + step.a) * z + step.b * data.velocity(z, rule.tau);
        let (first, later) = (rule.step(0), rule.step(1));
        let plain: Vec<f64> = (0..POINTS)
            .flat_map(|j| {
                let g = drift(first, place(j));
                (0..POINTS).map(move |i| SPACING * normal(place(i), g, first.s0 * first.s0))
            })
            .collect();
        let tied = || (0..POINTS).flat_map(|j| tied(place(j), later, &|z| drift(later, z))).collect();
        Self { first: plain, later: (later.s1 != 0.0).then(tied), shared: later.s1 }
    }

    /// The law after so many iterations.
    pub fn after(&self, start: &Law, iterations: u32) -> Law {
        let mut x = start.clone();
        for n in 0..iterations {
            x = Law(apply(if n == 0 { &self.first } else { self.later.as_ref().unwrap_or(&self.first) }, &x.0));
        }
        if iterations == 0 { x } else { x.blurred(self.shared) }
    }

    /// The law in which the chain settles, from one near it.
    pub fn settled(&self, start: &Law) -> Law {
        let mut x = start.clone();
        let matrix = self.later.as_ref().unwrap_or(&self.first);
        for _ in 0..20_000 {
            let next = apply(matrix, &x.0);
            let moved = next.iter().zip(&x.0).fold(0.0, |m: f64, (a, b)| m.max((a - b).abs()));
            x = Law(next);
            if moved < 1e-11 {
                break;
            }
        }
        x.blurred(self.shared)
    }
}

/// `matrix` has the densities that each point goes to, row by row of where it comes from.
fn apply(matrix: &[f64], from: &[f64]) -> Vec<f64> {
    let mut to = vec![0.0; POINTS];
    for (row, p) in matrix.chunks_exact(POINTS).zip(from) {
        if *p > 1e-30 {
            to.iter_mut().zip(row).for_each(|(t, k)| *t += p * k);
        }
    }
    to
}

/// Density of x' = g(x + s₁ ε) + s₀ ε over the grid: φ(ε)/(dx'/dε) at the ε that leads there, found by Newton's rule.
fn tied(x: f64, step: SdeStep, g: &dyn Fn(f64) -> f64) -> Vec<f64> {
    let to = |e: f64| g(x + step.s1 * e) + step.s0 * e;
    let slope = |e: f64| (to(e + 1e-4) - to(e - 1e-4)) / 2e-4;
    let mut e = (place(0) - to(0.0)) / slope(0.0);
    (0..POINTS)
        .map(|i| {
            for _ in 0..50 {
                let off = to(e) - place(i);
                e -= off / slope(e);
                if off.abs() < 1e-10 {
                    break;
                }
            }
            let density = SPACING * normal(e, 0.0, 1.0) / slope(e);
            e += SPACING / slope(e);
            density
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use physvideo::scene::Sde;

    use super::super::laws::{self, Moments, RULES};
    use super::*;

    const TAU: f64 = 0.8;

    /// On Gaussian data the quadrature must give the moments that the coefficients give.
    #[test]
    fn quadrature_is_the_recursion_on_gaussian_data() {
        let data = Data::gaussian(0.7, 1.0);
        for (sde, name) in RULES {
            let rule = SdeRule::new(sde, 0.2, TAU, None, false).unwrap();
            let transfer = Transfer::new(rule, &data);
            let start = Law::new(|z| normal(z, 1.2, 0.64));
            let mut want = Moments::start(1.2, 0.64);
            for n in 1..=6 {
                want = want.step(rule.step(n - 1), laws::line(TAU, 0.7, 1.0), 0.0);
                let law = transfer.after(&start, n);
                assert!((law.mass() - 1.0).abs() < 1e-9, "{name}: mass {}", law.mass());
                assert!((law.mean() - want.mean).abs() < 1e-9, "{name}: {} {}", law.mean(), want.mean);
                assert!((law.variance() - want.variance).abs() < 1e-8, "{name}: {} {want:?}", law.variance());
            }
            let settled = transfer.settled(&start).variance();
            let want = laws::settled_variance(sde, 0.2, TAU, laws::spread(TAU, 1.0));
            assert!((settled / want - 1.0).abs() < 1e-8, "{name}: {settled} {want}");
        }
        let half = Law::marginal(&Data::two_points(TAU, 1.5, 0.3), TAU);
        // Φ(1.5) = 0.9331928.
        assert!((half.upper() - (0.3 * 0.933_192_8 + 0.7 * 0.066_807_2)).abs() < 1e-6, "{}", half.upper());
        assert_eq!(RULES[0].0, Sde::EulerMaruyama);
    }
}

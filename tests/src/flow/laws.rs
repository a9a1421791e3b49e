//! Closed forms of Φ_CF on Gaussian data, and the moments of a chain from its coefficients. The closed forms are
//! written from the update (design notes "flow-sde"), not from `physvideo::flow`.

use physvideo::flow::SdeStep;
use physvideo::scene::{Sde, Solver};

/// Integrators in the order of tables and figures.
pub const RULES: [(Sde, &str); 4] = [
    (Sde::EulerMaruyama, "euler_maruyama"),
    (Sde::VarianceCorrected, "variance_corrected"),
    (Sde::LeimkuhlerMatthews, "leimkuhler_matthews"),
    (Sde::Exponential, "exponential"),
];

/// Solvers of the flow, with evaluations a step.
pub const SOLVERS: [(Solver, &str, u32); 3] =
    [(Solver::Euler, "euler", 1), (Solver::Ab2, "ab2", 1), (Solver::Heun, "heun", 2)];

/// Variance of the marginal of N(·, s²) at noise level τ: S = (1 − τ)² s² + τ².
pub fn spread(tau: f64, s2: f64) -> f64 {
    (1.0 - tau).powi(2) * s2 + tau * tau
}

/// Velocity towards N(mean, s²) as `(at 0, slope)`: v = mean + ((1 − τ) s² − τ)(z − (1 − τ) mean)/S.
pub fn line(tau: f64, mean: f64, s2: f64) -> (f64, f64) {
    let slope = ((1.0 - tau) * s2 - tau) / spread(tau, s2);
    (mean - slope * (1.0 - tau) * mean, slope)
}

/// Mean and variance after `n` iterations of the paper's update from those before: A = 1 − γ/S, about the marginal's
/// mean `settled`.
pub fn euler_maruyama(gamma: f64, spread: f64, settled: f64, (mean, variance): (f64, f64), n: u32) -> (f64, f64) {
    let a = 1.0 - gamma / spread;
    let power = a.powi(n as i32);
    let sum = (1.0 - power * power) / (1.0 - a * a);
    (settled + power * (mean - settled), power * power * variance + 2.0 * gamma * sum)
}

/// Variance in which an integrator settles on Gaussian data whose marginal has variance `s`.
pub fn settled_variance(sde: Sde, gamma: f64, tau: f64, s: f64) -> f64 {
    let t = tau * tau;
    match sde {
        Sde::EulerMaruyama => s / (1.0 - gamma / (2.0 * s)),
        Sde::VarianceCorrected => s * (2.0 - gamma / t) / (2.0 - gamma / s),
        Sde::LeimkuhlerMatthews => s,
        Sde::Exponential => s / (1.0 + (1.0 - t / s) * (gamma / (2.0 * t)).tanh()),
    }
}

/// Mean and variance of the Langevin equation itself after `time`, without steps.
pub fn langevin(spread: f64, settled: f64, (mean, variance): (f64, f64), time: f64) -> (f64, f64) {
    let e = (-time / spread).exp();
    (settled + e * (mean - settled), spread + e * e * (variance - spread))
}

/// The general β with the anchor: rate λ, and mean and variance it settles in.
pub struct Anchored {
    /// Rate of return; stable while positive and γ λ < 2.
    pub rate: f64,
    /// Settled mean.
    pub mean: f64,
    /// Settled variance of the paper's integrator.
    pub variance: f64,
    /// Largest β with a positive rate.
    pub limit: f64,
}

/// λ = 1/τ² − β (1 − τ) s²/(τ S) and what follows from it, for data N(`mean`, `s2`) and the anchor μ.
pub fn anchored(gamma: f64, tau: f64, beta: f64, (mean, s2): (f64, f64), mu: f64) -> Anchored {
    let s = spread(tau, s2);
    let rate = 1.0 / (tau * tau) - beta * (1.0 - tau) * s2 / (tau * s);
    let settled = (1.0 - tau) * mean + (mean - mu) * (beta - (1.0 - tau) / tau) / (tau * rate);
    let variance = 1.0 / (rate * (1.0 - 0.5 * gamma * rate));
    Anchored { rate, mean: settled, variance, limit: s / (tau * (1.0 - tau) * s2) }
}

/// Moments of a chain on one number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moments {
    /// Mean.
    pub mean: f64,
    /// Variance.
    pub variance: f64,
    /// Covariance with the noise that the next iteration shares.
    shared: f64,
}

impl Moments {
    /// Of a start that knows nothing of the noise to come.
    pub fn start(mean: f64, variance: f64) -> Self {
        Self { mean, variance, shared: 0.0 }
    }

    /// After one iteration with these coefficients, on data whose velocity is `at + slope z`, with anchor `mu`.
    pub fn step(self, step: SdeStep, (at, slope): (f64, f64), mu: f64) -> Self {
        let a = 1.0 + step.a + step.b * slope;
        Self {
            mean: a * self.mean + step.b * at + step.m * mu,
            variance: a * a * self.variance + 2.0 * a * step.s0 * self.shared + step.s0.powi(2) + step.s1.powi(2),
            shared: step.s1,
        }
    }

    /// Root of the mean square.
    pub fn rms(self) -> f64 {
        (self.variance + self.mean * self.mean).sqrt()
    }
}

/// Factor of the latent along one step of dz/dσ = k(σ) z between noise levels, for N(0, s²): √(S(to)/S(from)).
pub fn exact_flow(from: f64, to: f64, s2: f64) -> f64 {
    (spread(to, s2) / spread(from, s2)).sqrt()
}

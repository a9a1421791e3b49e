//! One iteration of the Consistency-Guided Flow SDE at a fixed noise level τ as coefficients, for every integrator.
//! Knows no device: `stages::latent` runs it.

use crate::scene::Sde;

/// z ← z + d (`a` z + `b` v + `m` μ) + √d (`s0` εₙ + `s1` εₙ₊₁), with d the weight of a cell, μ the encoded latent.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SdeStep {
    /// Factor of the latent, beyond the latent itself.
    pub a: f64,
    /// Factor of the velocity.
    pub b: f64,
    /// Factor of the encoded latent; 0 with the paper's β.
    pub m: f64,
    /// Factor of this iteration's noise.
    pub s0: f64,
    /// Factor of the next iteration's noise.
    pub s1: f64,
}

/// Why an SDE cannot be integrated as asked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum SdeError {
    /// τ outside (0, 1].
    #[error("the noise level of the SDE is {0}, it must be above 0 and at most 1")]
    Tau(f64),
    /// γ that is not a step.
    #[error("gamma {gamma} is out of range: {reason}")]
    Gamma {
        /// What was asked for.
        gamma: f64,
        /// What is allowed, and why.
        reason: String,
    },
    /// β with an integrator that is derived for the paper's.
    #[error("beta goes with sde = \"euler_maruyama\" or \"leimkuhler_matthews\": the others are derived for (1 - σ)/σ")]
    Beta,
    /// Weights between 0 and 1 with an integrator that is not linear in γ.
    #[error(
        "mask.pool = \"share\" goes with sde = \"euler_maruyama\" or \"leimkuhler_matthews\": the others need weights of 0 or 1"
    )]
    Soft,
}

/// The paper's β = (1 − τ)/τ, at which v_ε drops out (eq. 5).
pub fn paper_beta(tau: f64) -> f64 {
    (1.0 - tau) / tau
}

/// Largest γ at which Euler–Maruyama and Leimkuhler–Matthews stay bounded whatever the data: 2τ² (the stiffest data are
/// a point, whose marginal has variance τ²).
pub fn stable_gamma(tau: f64) -> f64 {
    2.0 * tau * tau
}

/// An integrator with its parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SdeRule {
    /// Which.
    pub sde: Sde,
    /// Step size γ.
    pub gamma: f64,
    /// Noise level τ, 0 < τ ≤ 1.
    pub tau: f64,
    /// β; absent: the paper's.
    pub beta: Option<f64>,
}

impl SdeRule {
    /// Checks that the parameters go together; `soft` when weights between 0 and 1 occur.
    ///
    /// # Errors
    /// [`SdeError`] says what does not.
    pub fn new(sde: Sde, gamma: f64, tau: f64, beta: Option<f64>, soft: bool) -> Result<Self, SdeError> {
        if !(tau > 0.0 && tau <= 1.0) {
            return Err(SdeError::Tau(tau));
        }
        let limit = |reason: String| Err(SdeError::Gamma { gamma, reason });
        if !(gamma > 0.0 && gamma.is_finite()) {
            return limit("it must be above 0".into());
        }
        if sde == Sde::VarianceCorrected && gamma > stable_gamma(tau) {
            return limit(format!(
                "sde = \"variance_corrected\" has no noise left above 2σ² = {:.4} at σ = {tau:.4}",
                stable_gamma(tau)
            ));
        }
        let linear = matches!(sde, Sde::EulerMaruyama | Sde::LeimkuhlerMatthews);
        if beta.is_some() && !linear {
            return Err(SdeError::Beta);
        }
        if soft && !linear {
            return Err(SdeError::Soft);
        }
        Ok(Self { sde, gamma, tau, beta })
    }

    /// Whether μ takes part.
    pub fn anchored(&self) -> bool {
        self.beta.is_some_and(|beta| beta != paper_beta(self.tau))
    }

    /// Iteration `n`, from 0.
    pub fn step(&self, n: u32) -> SdeStep {
        let Self { sde, gamma, tau, beta } = *self;
        let paper = paper_beta(tau);
        let beta = beta.unwrap_or(paper);
        // Paper, eq. (general_sde), with v_ε = (μ − z)/τ; the terms in μ vanish at the paper's β.
        let (a, b, m) = (-gamma / tau + (beta - paper) * gamma / tau, beta * gamma, -(beta - paper) * gamma / tau);
        match sde {
            Sde::EulerMaruyama => SdeStep { a, b, m, s0: (2.0 * gamma).sqrt(), s1: 0.0 },
            Sde::VarianceCorrected => {
                let variance = 2.0 * gamma - (gamma / tau).powi(2);
                SdeStep { a, b, m, s0: variance.max(0.0).sqrt(), s1: 0.0 }
            }
            // Noise shared by neighbouring iterations, √(γ/2)(εₙ + εₙ₊₁); the first has no neighbour before it, so its
            // own share is larger, or the variance would fall short.
            Sde::LeimkuhlerMatthews => {
                let half = (0.5 * gamma).sqrt();
                SdeStep { a, b, m, s0: if n == 0 { (1.5 * gamma).sqrt() } else { half }, s1: half }
            }
            // z' = e z + (1 − e)(1 − τ) x̂₀ + τ √(1 − e²) ε, x̂₀ = z + τ v, e = exp(−γ/τ²).
            Sde::Exponential => {
                let e = (-gamma / (tau * tau)).exp();
                let share = -(-gamma / (tau * tau)).exp_m1() * (1.0 - tau);
                let s0 = tau * (-(-2.0 * gamma / (tau * tau)).exp_m1()).max(0.0).sqrt();
                SdeStep { a: (e - 1.0) + share, b: share * tau, m: 0.0, s0, s1: 0.0 }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TAU: f64 = 28.0 / 29.0;

    fn rule(sde: Sde) -> SdeRule {
        SdeRule::new(sde, 0.2, TAU, None, false).unwrap()
    }

    /// The update is z + γ ∇log p + √2γ ε: unadjusted Langevin (flow-sde, closed form 1).
    #[test]
    fn euler_maruyama_is_langevin_on_the_marginal() {
        for i in 0..100 {
            let tau = 0.05 + 0.0095 * f64::from(i);
            let (z, v) = (1.3 - 0.07 * f64::from(i), -0.4 + 0.03 * f64::from(i));
            let s = SdeRule::new(Sde::EulerMaruyama, 0.2, tau, None, false).unwrap().step(3);
            let score = -z / tau + (1.0 - tau) / tau * v;
            assert!((s.a * z + s.b * v - 0.2 * score).abs() < 1e-12 * (1.0 + score.abs()));
            assert!((s.s0 - 0.4f64.sqrt()).abs() < 1e-15 && s.s1 == 0.0 && s.m.abs() < 1e-12);
        }
    }

    /// Another β is the paper's general update with v_ε = (μ − z)/τ.
    #[test]
    fn beta_weighs_the_velocity_against_the_anchor() {
        let (z, v, mu, beta, gamma) = (0.7, -0.3, 0.2, 0.5, 0.1);
        let s = SdeRule::new(Sde::EulerMaruyama, gamma, TAU, Some(beta), false).unwrap().step(0);
        let eps = (mu - z) / TAU;
        let want = -gamma / TAU * z + beta * gamma * v - (beta - paper_beta(TAU)) * gamma * eps;
        assert!((s.a * z + s.b * v + s.m * mu - want).abs() < 1e-14);
        let same = SdeRule::new(Sde::EulerMaruyama, gamma, TAU, Some(paper_beta(TAU)), false).unwrap();
        assert!(!same.anchored() && same.step(0).m == 0.0);
    }

    /// For point data v = (x₀ − z)/τ, the exponential rule is exact: mean factor e, variance τ²(1 − e²).
    #[test]
    fn the_exponential_rule_is_exact_for_point_data() {
        let s = rule(Sde::Exponential).step(5);
        let e = (-0.2 / (TAU * TAU)).exp();
        assert!((1.0 + s.a - s.b / TAU - e).abs() < 1e-14);
        assert!((s.s0.powi(2) - TAU * TAU * (1.0 - e * e)).abs() < 1e-14);
    }

    #[test]
    fn every_first_step_adds_the_same_variance() {
        let total = |s: SdeStep| s.s0 * s.s0 + s.s1 * s.s1;
        assert!((total(rule(Sde::LeimkuhlerMatthews).step(0)) - total(rule(Sde::EulerMaruyama).step(0))).abs() < 1e-15);
    }

    #[test]
    fn what_does_not_go_together_is_refused() {
        let new = SdeRule::new;
        assert!(matches!(new(Sde::EulerMaruyama, 0.0, TAU, None, false), Err(SdeError::Gamma { .. })));
        assert!(matches!(new(Sde::EulerMaruyama, f64::NAN, TAU, None, false), Err(SdeError::Gamma { .. })));
        assert!(matches!(new(Sde::EulerMaruyama, 0.2, 0.0, None, false), Err(SdeError::Tau(_))));
        assert!(matches!(new(Sde::VarianceCorrected, 1.9, TAU, None, false), Err(SdeError::Gamma { .. })));
        assert_eq!(new(Sde::Exponential, 0.2, TAU, Some(0.1), false), Err(SdeError::Beta));
        assert_eq!(new(Sde::VarianceCorrected, 0.2, TAU, None, true), Err(SdeError::Soft));
        assert!(new(Sde::LeimkuhlerMatthews, 0.2, TAU, Some(0.1), true).is_ok());
    }
}

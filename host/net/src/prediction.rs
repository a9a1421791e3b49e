//! What a network predicts, and how the velocity follows from it. Runs no network.

use crate::schedule::Sigma;

/// What the network's output means. z = (1 - sigma) x0 + sigma eps throughout.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Prediction {
    /// eps - x0 (FramePack, Wan, LTX).
    EpsMinusX0,
    /// x0 - eps, the velocity itself.
    X0MinusEps,
    /// The clean latent.
    X0,
    /// v-prediction of a variance-preserving model: a eps - b x0 with a^2 + b^2 = 1 (CogVideoX).
    VpV,
}

/// How velocity and network input follow from what is known: v = `prediction` p + `latent` z, where v points towards
/// the data (x0 - eps), p is the network's output and the network is given `input` z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coefficients {
    /// Of the network's output.
    pub prediction: f64,
    /// Of z.
    pub latent: f64,
    /// Of z in the network's input.
    pub input: f64,
}

/// The least noise at which a clean latent has a velocity; the velocity of `X0` is singular at 0.
pub const LEAST_SIGMA_OF_X0: f64 = 1e-6;

impl Prediction {
    /// The coefficients at one noise level. `X0` is singular at 0; sigma is held at 1e-6 there (a manifest's
    /// `least_sigma` holds it higher).
    pub fn coefficients(self, sigma: Sigma) -> Coefficients {
        let s = sigma.value();
        match self {
            Self::EpsMinusX0 => Coefficients { prediction: -1.0, latent: 0.0, input: 1.0 },
            Self::X0MinusEps => Coefficients { prediction: 1.0, latent: 0.0, input: 1.0 },
            Self::X0 => {
                let s = s.max(LEAST_SIGMA_OF_X0);
                Coefficients { prediction: 1.0 / s, latent: -1.0 / s, input: 1.0 }
            }
            Self::VpV => {
                // x_t = z / n = a x0 + b eps; x0 = a x_t - b p, eps = b x_t + a p.
                let n = (1.0 - s).hypot(s);
                let (a, b) = ((1.0 - s) / n, s / n);
                Coefficients { prediction: -(a + b), latent: (a - b) / n, input: 1.0 / n }
            }
        }
    }

    /// Whether the velocity is the prediction but for a factor that no noise level changes.
    pub fn is_plain(self) -> bool {
        matches!(self, Self::EpsMinusX0 | Self::X0MinusEps)
    }

    /// Whether the network is given z itself at every noise level.
    pub fn takes_z(self) -> bool {
        self != Self::VpV
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What an ideal network would answer, from the definition of each prediction.
    fn ideal(prediction: Prediction, x0: f64, eps: f64, s: f64) -> f64 {
        let n = ((1.0 - s).powi(2) + s * s).sqrt();
        match prediction {
            Prediction::EpsMinusX0 => eps - x0,
            Prediction::X0MinusEps => x0 - eps,
            Prediction::X0 => x0,
            Prediction::VpV => (1.0 - s) / n * eps - s / n * x0,
        }
    }

    #[test]
    fn every_prediction_gives_the_same_velocity() {
        let table = (0..=25).map(|i| 7.0 * i as f64 / 25.0 / (1.0 + 6.0 * i as f64 / 25.0));
        for s in table.chain([1e-6, 1e-3, 0.5, 1.0 - 1e-6, 1.0]) {
            for (x0, eps) in [(0.7, -1.3), (-2.0, 0.4), (0.0, 3.0), (1.5, 1.5)] {
                let z = (1.0 - s) * x0 + s * eps;
                for prediction in [Prediction::EpsMinusX0, Prediction::X0MinusEps, Prediction::X0, Prediction::VpV] {
                    // A clean latent says nothing about noise at 0.
                    if prediction == Prediction::X0 && s == 0.0 {
                        continue;
                    }
                    let c = prediction.coefficients(Sigma::new(s).unwrap());
                    let v = c.prediction * ideal(prediction, x0, eps, s) + c.latent * z;
                    // Cancellation in (p - z) / sigma costs one part in 1e16 over sigma.
                    assert!((v - (x0 - eps)).abs() < 1e-6_f64.max(1e-15 / s.max(1e-9)), "{prediction:?} at {s}: {v}");
                }
            }
        }
    }

    #[test]
    fn a_vp_network_is_given_z_on_the_unit_circle() {
        for s in [0.0, 0.2, 0.5, 0.9, 1.0] {
            let c = Prediction::VpV.coefficients(Sigma::new(s).unwrap());
            // Unit variance data and noise stay of unit variance.
            assert!((c.input * (1.0 - s)).hypot(c.input * s) - 1.0 < 1e-12);
        }
    }

    #[test]
    fn the_clean_latent_is_finite_at_zero() {
        let c = Prediction::X0.coefficients(Sigma::new(0.0).unwrap());
        assert!(c.prediction.is_finite() && c.latent.is_finite());
    }
}

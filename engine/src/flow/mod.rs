//! The arithmetic of Φ_CF in f64: coefficients of every step of Algorithm 1. Knows no device and no network.
//!
//! z_σ = (1 − σ) x₀ + σ ε with σ from 0 (clean) to 1 (noise). Velocities point **to the data**: v = x₀ − ε, so
//! dz/dσ = −v, x₀ = z + σ v, and the score is ∇log p = −z/σ + ((1 − σ)/σ) v.

mod sde;
mod solver;

pub use sde::{SdeError, SdeRule, SdeStep, paper_beta, stable_gamma};
pub use solver::{FlowStep, ab2, euler, heun_corrector};

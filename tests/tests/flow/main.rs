//! Φ_CF on laws that are known: every closed form, in f64 and on the device, each with a control that must be told
//! apart. Bounds are four standard errors of so many numbers, or the rounding of f32.

mod anchor;
mod bench;
mod exact;
mod forgetting;
mod integrators;
mod masks;
mod mixture;
mod noise;
mod sign;
mod stability;
mod trips;

use physvideo::flow::SdeRule;
use physvideo::scene::Sde;
use physvideo::stages::latent::NoiseKey;

/// The paper's noise level: step 20 of 25 with shift 7.
const TAU: f64 = 28.0 / 29.0;
/// The paper's step.
const GAMMA: f64 = 0.2;
/// Numbers of a latent whose moments are measured.
const MANY: usize = 1 << 20;

/// Noise of the chain, and of its start.
const CHAIN: NoiseKey = NoiseKey { seed: 0x5eed_0001_0000_0007, stream: 3 };
const START: NoiseKey = NoiseKey { seed: 0x5eed_0001_0000_0007, stream: 4 };

fn rule(sde: Sde, gamma: f64, tau: f64) -> SdeRule {
    SdeRule::new(sde, gamma, tau, None, false).unwrap()
}

/// Fails unless a measured figure is within four standard errors, and what f32 rounds, of what is right.
#[track_caller]
fn within(what: &str, measured: f64, right: f64, error: f64) {
    let bound = 4.0 * error + 2e-6 * right.abs();
    assert!((measured - right).abs() < bound, "{what}: {measured} is not {right} ± {bound}");
}

/// Fails unless a figure rounds to the one written down.
#[track_caller]
fn rounds(what: &str, figure: f64, written: f64, digits: i32) {
    let half = 0.5000001 * 10f64.powi(-digits);
    assert!((figure - written).abs() < half, "{what}: {figure} does not round to {written}");
}

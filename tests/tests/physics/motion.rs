//! M1: free fall and free rotation.

use physvideo_tests::device::gpu;
use physvideo_tests::problems::motion::{fall, spin};

use super::at;

#[test]
fn a_block_falls_freely() {
    let gpu = gpu();
    let (outcome, steps) = fall(&gpu, at(8, 0.2), 1.0).unwrap();
    // f32 carries 6e-8 a step; the mass's own rounding enters once.
    let tolerance = 6e-8 * f64::from(steps) * 2.0;
    assert!(steps >= 64 && outcome.error < tolerance, "{outcome:?} after {steps} steps");
    // Control: the position of an explicit update, n (n − 1) / 2, is off by 2/n; as much more gravity is told apart.
    let (more, _) = fall(&gpu, at(8, 0.2), 1.0 + 2.0 / f64::from(steps)).unwrap();
    assert!(more.error > 1.0 / f64::from(steps), "{more:?}");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Spinning freely, momentum stays zero and the angular momentum that APIC carries stays what it was.
#[test]
fn a_block_spins_freely() {
    let gpu = gpu();
    let (outcome, momentum) = spin(&gpu, at(8, 0.75)).unwrap();
    // APIC conserves both exactly; f32 sums over some hundred substeps leave 1e-5.
    assert!(outcome.error < 1e-5 && outcome.clamps == 0, "{outcome:?}");
    assert!(momentum < 1e-6, "momentum {momentum}");
}

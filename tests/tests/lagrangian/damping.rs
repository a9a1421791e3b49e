//! Damping takes energy from what deforms, and next to nothing from what flies or turns as a whole.

use physvideo::stages::solver::Measure;
use physvideo_tests::device::gpu;
use physvideo_tests::liquid::plane;

use super::setup::{body, fill, solver, world};

const DX: f64 = 0.025;

/// A jelly cube of 0.1 m, E 2e4 Pa, ν 0.3, 1000 kg/m³; before and after half a second.
fn play(damping: f32, velocity: impl Fn([f32; 3]) -> [f32; 3], falls: bool) -> [Measure; 2] {
    let gpu = gpu();
    let mut jelly = body((2e4, 0.3), 1000.0, DX, fill(DX, [-2.0 * DX; 3], [2.0 * DX; 3], |_| true), velocity);
    jelly.damping = damping;
    let mut w = world(vec![jelly], DX);
    if falls {
        w.gravity = [0.0, 0.0, -9.81];
        w.colliders = vec![plane([0.0, 0.0, -0.06], [0.0, 0.0, 1.0], false)];
    }
    let mut solver = solver(&gpu, &w);
    let before = solver.measure(0).unwrap();
    for _ in 0..10 {
        let stats = solver.frame(0.05).unwrap();
        assert_eq!((stats.rejected, stats.clamped_velocity, stats.quarantined), (0, 0, 0));
    }
    [before, solver.measure(0).unwrap()]
}

#[test]
fn what_turns_and_flies_as_a_whole_goes_on() {
    let turn = |x: [f32; 3]| [1.0 - 10.0 * x[1], 10.0 * x[0], 0.0];
    let [before, after] = play(5e-3, turn, false);
    let lost = 1.0 - after.spin[2] / before.spin[2];
    let slower = (after.momentum[0] / before.momentum[0] - 1.0).abs();
    println!("damped by 5 ms, 10 rad/s for 0.5 s: spin lost {lost:.2e}, momentum off by {slower:.1e}");
    // Sums of some 200 steps in f32. Damping by the rate of the forces themselves, u + β v for u, lost 5 % at 1 ms.
    assert!(slower < 1e-5, "momentum off by {slower:.1e}");
    assert!(lost.abs() < 1e-4, "spin lost {lost:.2e}");
}

#[test]
fn a_damped_jelly_comes_to_rest() {
    let still = |_: [f32; 3]| [0.0, 0.0, -0.5];
    let moving = |damping: f32| play(damping, still, true)[1].kinetic;
    let (free, damped) = (moving(0.0), moving(5e-3));
    println!("jelly 0.5 s after its fall: {free:.2e} J in motion, damped {damped:.2e} J");
    assert!(damped < 0.2 * free, "damped {damped:.2e} J of {free:.2e} J");
}

//! M1: free fall and free rotation of an elastic block.

use physvideo::scene::Material;
use physvideo_tests::device::gpu;

use super::setup::{body, center, fill, solver, world};

const SOFT: Material = Material::Elastic { young: 1e3, poisson: 0.3 };

/// After n steps of dt: v = n g dt and x = x0 + g dt² n (n + 1) / 2, each to f32 rounding of n additions.
#[test]
fn a_block_falls_freely() {
    let gpu = gpu();
    let dx = 1.0 / 32.0;
    let cube = fill(dx, [0.25; 3], [0.5; 3], |_| true);
    let mut w = world(vec![body(SOFT, 100.0, dx, cube, |_| [0.0; 3])], dx, [0.0, 0.0, -1.0], [1.0; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.force_dt = Some(1.0 / 1024.0); // a power of two, so that n steps fill the frame exactly
    let mut mpm = solver(&gpu, &w, true);
    let before = center(&gpu, &mpm);
    let stats = mpm.frame(128.0 / 1024.0).unwrap();
    assert_eq!(stats.substeps, 128);
    let (n, dt, g) = (128.0, 1.0 / 1024.0, 9.81);
    let m = mpm.measure(0).unwrap();
    let v = m.momentum[2] / m.mass;
    let fallen = before[2] - center(&gpu, &mpm)[2];
    // f32 carries 6e-8 a step; the mass's own rounding enters once.
    let tolerance = 6e-8 * n * 2.0;
    assert!((v / (-g * dt * n) - 1.0).abs() < tolerance, "v {v}");
    assert!((fallen / (g * dt * dt * n * (n + 1.0) / 2.0) - 1.0).abs() < tolerance, "x {fallen}");
    // Control: the formula of an explicit position update, n (n − 1) / 2, is off by 1.6 % and must be told apart.
    assert!((fallen / (g * dt * dt * n * (n - 1.0) / 2.0) - 1.0).abs() > 1e-2);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Gravity of a body's own: one falls, one rises as fast, one without weight stays, in one scene.
#[test]
fn bodies_have_gravity_of_their_own() {
    let gpu = gpu();
    let dx = 1.0 / 32.0;
    let own = [None, Some([0.0, 0.0, 9.81]), Some([0.0; 3])];
    let bodies = own.iter().zip(0..).map(|(gravity, i)| {
        let x = f64::from(i) * 0.5;
        let cube = fill(dx, [x, 0.0, 0.0], [x + 0.125, 0.125, 0.125], |_| true);
        physvideo::world::Body { gravity: *gravity, ..body(SOFT, 100.0, dx, cube, |_| [0.0; 3]) }
    });
    let mut w = world(bodies.collect(), dx, [-0.5, -0.5, -1.0], [1.5, 0.5, 1.0]);
    w.gravity = [0.0, 0.0, -9.81];
    let mut mpm = solver(&gpu, &w, true);
    mpm.frame(0.125).unwrap();
    let speed = |i| {
        let m = mpm.measure(i).unwrap();
        m.momentum[2] / m.mass
    };
    // v = g t, to f32 rounding of some dozen steps; they are too far apart to share a node.
    for (i, g) in [-9.81, 9.81, 0.0].into_iter().enumerate() {
        assert!((speed(i) - g * 0.125).abs() < 1e-5, "body {i}: {}", speed(i));
    }
}

/// Spinning freely, momentum stays zero and the angular momentum that APIC carries stays what it was.
#[test]
fn a_block_spins_freely() {
    let gpu = gpu();
    let dx = 1.0 / 32.0;
    let cube = fill(dx, [-0.125; 3], [0.125; 3], |_| true);
    let spin = |x: [f32; 3]| [-4.0 * x[1], 4.0 * x[0], 0.0];
    let mut mpm = solver(&gpu, &world(vec![body(SOFT, 100.0, dx, cube, spin)], dx, [-0.5; 3], [0.5; 3]), true);
    // The first step fills C, which carries part of the angular momentum from then on.
    mpm.frame(0.004).unwrap();
    let total = |mpm: &physvideo::stages::mpm::Mpm| {
        let particles = gpu.read(mpm.particles).unwrap();
        let d2 = dx * dx / 4.0;
        particles.iter().fold((0.0, 0.0), |(l, p), q| {
            let (m, c) = (f64::from(q.m), |r: f32| f64::from(r));
            let own = d2 * (c(q.c1[0]) - c(q.c0[1]));
            (l + m * (c(q.x[0]) * c(q.v[1]) - c(q.x[1]) * c(q.v[0]) + own), p + m * c(q.v[0]))
        })
    };
    let (before, _) = total(&mpm);
    mpm.frame(0.2).unwrap();
    let (after, momentum) = total(&mpm);
    // APIC conserves both exactly; f32 sums over some hundred substeps leave 1e-5.
    assert!((after / before - 1.0).abs() < 1e-5, "angular momentum {before} → {after}");
    let mass = mpm.measure(0).unwrap().mass;
    assert!(momentum.abs() < 1e-6 * mass, "momentum {momentum}");
}

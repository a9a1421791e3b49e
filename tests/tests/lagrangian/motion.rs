//! M1: free fall and free rotation.

use physvideo_tests::device::gpu;

use super::setup::{body, center, fill, particles, solver, world};

const SOFT: (f64, f64) = (1e3, 0.3);

/// Velocity Verlet is exact under a constant force: v = g t, x = g t²/2, each to f32 rounding of n additions.
#[test]
fn a_block_falls_freely() {
    let gpu = gpu();
    let dx = 1.0 / 32.0;
    let cube = fill(dx, [0.25; 3], [0.5; 3], |_| true);
    let mut w = world(vec![body(SOFT, 100.0, dx, cube, |_| [0.0; 3])], dx);
    w.gravity = [0.0, 0.0, -9.81];
    w.force_dt = Some(1.0 / 1024.0); // a power of two, so that n steps fill the frame exactly
    let mut solver = solver(&gpu, &w);
    let before = center(&particles(&gpu, &solver), |_| true);
    let stats = solver.frame(128.0 / 1024.0).unwrap();
    assert_eq!(stats.substeps, 128);
    let (n, dt, g) = (128.0, 1.0 / 1024.0, 9.81);
    let m = solver.measure(0).unwrap();
    let v = m.momentum[2] / m.mass;
    let fallen = before[2] - center(&particles(&gpu, &solver), |_| true)[2];
    let tolerance = 6e-8 * n * 2.0;
    assert!((v / (-g * dt * n) - 1.0).abs() < tolerance, "v {v}");
    assert!((fallen / (g * dt * dt * n * n / 2.0) - 1.0).abs() < tolerance, "x {fallen}");
    // Control: the formula of symplectic Euler, n (n + 1) / 2, is off by 0.8 % and must be told apart.
    assert!((fallen / (g * dt * dt * n * (n + 1.0) / 2.0) - 1.0).abs() > 5e-3);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// A spinning block keeps both momenta through many turns. The scheme keeps them exactly; f32 adds 6e-8 a node and step
/// of random sign.
#[test]
fn a_block_spins_freely() {
    let gpu = gpu();
    let dx = 1.0 / 32.0;
    let cube = fill(dx, [-0.125; 3], [0.125; 3], |_| true);
    let spin = |x: [f32; 3]| [0.3 - 4.0 * x[1], 4.0 * x[0], 0.0];
    let mut solver = solver(&gpu, &world(vec![body(SOFT, 100.0, dx, cube.clone(), spin)], dx));
    let before = solver.measure(0).unwrap();
    // The start is the motion asked for: I = m a²/6 of a cube, less what particles at quarters of cells leave of it.
    let moment: f64 = cube.iter().map(|x| f64::from(x[0]).powi(2) + f64::from(x[1]).powi(2)).sum::<f64>() * before.mass
        / cube.len() as f64;
    // Lumping spreads a point over its nodes: m dx²/4 a direction, the second moment of the B-spline.
    let lumped = moment + before.mass * 2.0 * 0.25 * dx * dx;
    assert!((before.spin[2] / (4.0 * lumped) - 1.0).abs() < 1e-5, "{} of {}", before.spin[2], 4.0 * lumped);
    let stats = solver.frame(0.2).unwrap();
    let after = solver.measure(0).unwrap();
    println!("spin: {} → {}, {} substeps", before.spin[2], after.spin[2], stats.substeps);
    assert!((after.spin[2] / before.spin[2] - 1.0).abs() < 1e-6, "{} → {}", before.spin[2], after.spin[2]);
    assert!((after.momentum[0] / (0.3 * after.mass) - 1.0).abs() < 1e-6, "{:?}", after.momentum);
    // It turned by 0.8: a node of the rim is elsewhere. Control: without the turn the place would be the old one.
    let corner = particles(&gpu, &solver)[0];
    assert!((corner.x[0] - cube[0][0] - 0.06).abs() > 0.05);
}

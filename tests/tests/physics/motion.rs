//! M1: free fall and free rotation.

use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::world::Body;
use physvideo_gpu::Recording;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::motion::{fall, spin};
use physvideo_tests::problems::setup::{Lattice, solver, world};

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

/// Gravity of a body's own: one falls, one rises as fast, one without weight stays, in one scene.
#[test]
fn bodies_have_gravity_of_their_own() {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 32.0);
    let soft = Material::Elastic { young: 1e3, poisson: 0.3 };
    let own = [None, Some([0.0, 0.0, 9.81]), Some([0.0; 3])];
    let bodies = own.iter().zip(0..).map(|(gravity, i)| {
        let x = f64::from(i) * 0.5;
        let cube = lattice.fill([x, 0.0, 0.0], [x + 0.125, 0.125, 0.125], |_| true);
        Body { gravity: *gravity, ..lattice.body(soft, 100.0, &cube, |_| [0.0; 3]) }
    });
    let mut w = world(bodies.collect(), lattice.dx, [-0.5, -0.5, -1.0], [1.5, 0.5, 1.0]);
    w.gravity = [0.0, 0.0, -9.81];
    let mut mpm = solver(&gpu, &w, "updated_lagrangian").unwrap();
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
    let (outcome, momentum) = spin(&gpu, at(8, 0.75)).unwrap();
    // APIC conserves both exactly; f32 sums over some hundred substeps leave 1e-5.
    assert!(outcome.error < 1e-5 && outcome.clamps == 0, "{outcome:?}");
    assert!(momentum < 1e-6, "momentum {momentum}");
}

/// A frame given up between two substeps has claimed the blocks of the next: the next frame starts without them.
#[test]
fn a_frame_that_was_given_up_leaves_no_claims() {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 32.0);
    let cube = lattice.fill([0.0; 3], [0.125; 3], |_| true);
    let soft = Material::Elastic { young: 1e3, poisson: 0.3 };
    let rising = lattice.body(soft, 100.0, &cube, |_| [0.0, 0.0, 0.5]);
    let mut w = world(vec![rising], lattice.dx, [-0.5, -0.5, -1.0], [0.5, 0.5, 1.0]);
    w.gravity = [0.0; 3];
    let mut mpm = Mpm::new(&gpu, &w, Method::default()).unwrap();
    mpm.start_clock(0.125).unwrap();
    let mut substep = Recording::new("substep");
    mpm.record_substep(&mut substep);
    gpu.run(&substep).unwrap();
    let before = mpm.measure(0).unwrap();
    let stats = mpm.frame(0.125).unwrap();
    let after = mpm.measure(0).unwrap();
    // A rigid motion at 0.5 m/s, to f32 rounding of some dozen steps.
    let risen = (after.height - before.height) / after.mass;
    assert!(stats.substeps > 1 && stats.quarantined == 0, "{stats:?}");
    assert!((risen - 0.5 * 0.125).abs() < 1e-5, "it rose by {risen}");
}

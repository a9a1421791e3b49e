//! Pins and prestress: what is held does not move at all, and a held body that carries its weight starts at rest.

use physvideo_gpu::kernels::Field;
use physvideo_tests::device::gpu;

use super::setup::{body, center, fill, particles, solver, world};

/// An arm held at one end for a tenth of a second: the way of its centre, and whether a held particle moved.
fn sink(prestress: bool, push: f32) -> ([f64; 3], bool) {
    let gpu = gpu();
    let dx = 1.0 / 32.0;
    let arm = fill(dx, [0.0, 0.0, 0.4], [0.5, 2.0 * dx, 0.4 + 2.0 * dx], |_| true);
    let mut held = body((2e4, 0.3), 40.0, dx, arm, |_| [0.0; 3]);
    held.pinned = held.positions.iter().map(|x| x[0] < 0.1).collect();
    held.prestress = prestress;
    let mut w = world(vec![held], dx);
    w.gravity = [0.0, 0.0, -9.81];
    w.fields = vec![Field { kind: 1, end: 1e9, a: [0.0, push, 0.0, 0.0], ..Default::default() }];
    let mut solver = solver(&gpu, &w);
    let before = particles(&gpu, &solver);
    solver.frame(0.1).unwrap();
    let after = particles(&gpu, &solver);
    let moved = w.bodies[0].pinned.iter().zip(before.iter().zip(&after)).any(|(held, (b, a))| *held && b.x != a.x);
    let (from, to) = (center(&before, |_| true), center(&after, |_| true));
    (std::array::from_fn(|a| to[a] - from[a]), moved)
}

#[test]
fn a_held_body_starts_at_rest() {
    let (still, moved) = sink(true, 0.0);
    assert!(still.iter().all(|c| c.abs() < 1e-9) && !moved, "it moves without a cause: {still:?}");
    // Controls: without prestress it sinks; with it, a push still moves it, sideways only. The pins hold in each.
    let (sunk, moved) = sink(false, 0.0);
    assert!(sunk[2] < -1e-3 && !moved, "{sunk:?}");
    let (pushed, moved) = sink(true, 5.0);
    assert!(pushed[1] > 1e-3 && pushed[2].abs() < 0.1 * pushed[1] && !moved, "{pushed:?}");
}

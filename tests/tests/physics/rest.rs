//! Prestress: a held body that carries its weight from the start stays where it is, and still moves when pushed.

use physvideo::scene::Material;
use physvideo_gpu::kernels::Field;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::setup::{Lattice, Play, world};

fn sink(prestress: bool, push: f32) -> [f64; 3] {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 32.0);
    let dx = lattice.dx;
    let arm = lattice.fill([0.0, 0.0, 0.4], [0.5, 2.0 * dx, 0.4 + 2.0 * dx], |_| true);
    let mut held = lattice.body(Material::Elastic { young: 2e4, poisson: 0.3 }, 40.0, &arm, |_| [0.0; 3]);
    held.pinned = held.positions.iter().map(|x| x[0] < 0.1).collect();
    held.prestress = prestress;
    let mut w = world(vec![held], dx, [-0.2, -0.2, 0.0], [0.8, 0.3, 0.6]);
    w.gravity = [0.0, 0.0, -9.81];
    w.fields = vec![Field { kind: 1, end: 1e9, a: [0.0, push, 0.0, 0.0], ..Default::default() }];
    let mut play = Play::new(&gpu, &w, "updated_lagrangian").unwrap();
    let before = play.center().unwrap();
    play.frame(0.1).unwrap();
    let after = play.center().unwrap();
    std::array::from_fn(|a| after[a] - before[a])
}

#[test]
fn a_held_body_starts_at_rest() {
    assert!(sink(true, 0.0).iter().all(|c| c.abs() < 1e-9), "it moves without a cause");
    // Controls: without prestress it sinks; with it, a push still moves it, sideways only.
    assert!(sink(false, 0.0)[2] < -1e-3);
    let pushed = sink(true, 5.0);
    assert!(pushed[1] > 1e-3 && pushed[2].abs() < 0.1 * pushed[1], "{pushed:?}");
}

//! The stiffness cap: a stiff cube falls, lands and lies as it would without, in fewer steps.

use physvideo::cap::apply;
use physvideo::scene::Material;
use physvideo::world::{World, ground};
use physvideo_tests::device::gpu;
use physvideo_tests::problems::setup::{Lattice, solver, world};

/// Side of the cube [m], and how high it starts above the ground.
const SIDE: f64 = 0.25;
const DROP: f64 = 0.25;
/// Deformation that is allowed.
const SHARE: f32 = 0.1;
/// Frames [s].
const FRAME: f32 = 0.02;

/// A cube of 1000 kg/m³ and ten megapascals, four cells a side, that starts `up` metres above the ground.
fn cube(up: f64) -> World {
    let lattice = Lattice::of_eight(SIDE / 4.0);
    let cube = lattice.fill([0.0, 0.0, up], [SIDE, SIDE, up + SIDE], |_| true);
    let stiff = Material::Elastic { young: 1e7, poisson: 0.3 };
    let body = lattice.body(stiff, 1000.0, &cube, |_| [0.0; 3]);
    let mut w = world(vec![body], lattice.dx, [-0.5, -0.5, -0.25], [0.75; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.3)];
    w
}

/// Height of the centre after each frame [m], and the substeps of all.
fn fall(w: &World, frames: usize) -> (Vec<f64>, u32) {
    let gpu = gpu();
    let mut mpm = solver(&gpu, w, "updated_lagrangian").unwrap();
    let (mut heights, mut substeps) = (Vec::new(), 0);
    for _ in 0..frames {
        substeps += mpm.frame(FRAME).unwrap().substeps;
        let m = mpm.measure(0).unwrap();
        heights.push(m.height / m.mass);
    }
    (heights, substeps)
}

#[test]
fn a_capped_cube_lands_and_lies_as_it_should() {
    let mut softer = cube(DROP);
    let capped = apply(SHARE, &mut softer);
    // ρ v²/ε² = 1000 · 2 · 9.81 · (0.25 + half a spacing) / 0.01.
    let by_hand = 1000.0 * 2.0 * 9.81 * (DROP + SIDE / 16.0) / 0.01;
    assert!(capped.len() == 1 && (f64::from(capped[0].effective) / by_hand - 1.0).abs() < 1e-3, "{capped:?}");
    let size = f64::from(SHARE) * SIDE;

    // To the first rebound.
    let (stiff, steps) = fall(&cube(DROP), 15);
    let (soft, fewer) = fall(&softer, 15);
    // The grid stops it almost a cell above the ground, with the cap as without.
    let landed = |h: &[f64]| h.iter().position(|z| *z < 0.8 * SIDE);
    assert!(landed(&stiff).is_some() && landed(&stiff) == landed(&soft), "{stiff:?}\n{soft:?}");
    let ratio = f64::from(steps) / f64::from(fewer);
    let root = f64::from(capped[0].factor()).sqrt();
    println!("cap: {steps} and {fewer} steps, {ratio:.2} for {root:.2}");
    // Its own speed counts beside that of waves, and frames are divided into whole steps.
    assert!((0.8 * root..1.1 * root).contains(&ratio), "{ratio} for {root}");
    // That cell of air is pressed too, so it goes down by somewhat more than its own share.
    let least = |h: &[f64]| h.iter().fold(f64::MAX, |l, z| l.min(*z));
    assert!(least(&stiff) - least(&soft) < 1.5 * size, "{stiff:?}\n{soft:?}");
    // Control: a hundredth of what the formula gives is told apart.
    let mut jelly = cube(DROP);
    jelly.bodies[0].material = jelly.bodies[0].material.with_young(capped[0].effective / 100.0);
    let (jelly, _) = fall(&jelly, 15);
    assert!(least(&stiff) - least(&jelly) > 2.5 * size, "{jelly:?}");

    // Set down where the grid holds it, it lies still, or swings about where it will: the mean of the last 0.4 s.
    let rest = |h: &[f64]| h[20..].iter().sum::<f64>() / 20.0;
    let mut lies = cube(0.05);
    let (stiff, _) = fall(&lies, 40);
    lies.bodies[0].material = softer.bodies[0].material;
    let (soft, _) = fall(&lies, 40);
    println!("cap: lies at {} and {}", rest(&stiff), rest(&soft));
    assert!((rest(&stiff) - rest(&soft)).abs() < size, "{stiff:?}\n{soft:?}");
    lies.bodies[0].material = lies.bodies[0].material.with_young(capped[0].effective / 100.0);
    let (sagged, _) = fall(&lies, 40);
    assert!(rest(&stiff) - rest(&sagged) > size, "{sagged:?}");
}

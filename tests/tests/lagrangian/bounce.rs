//! What bounces without friction or damping keeps its energy, or loses little: thirty bounces make none.

use physvideo::stages::lagrangian::Lagrangian;
use physvideo::world::{Body, World, ground};
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::{device, folder};

use super::setup::{body, fill, solver, world};

const G: f64 = 9.81;
const SIDE: f64 = 0.25;
const BOUNCES: f64 = 30.0;

/// A block or ball as wide as `cells` cells, of waves of 25.9 m/s, that falls `height` [m].
fn drop(ball: bool, cells: f64, height: f64) -> (World, f64) {
    let dx = SIDE / cells;
    let middle = [SIDE / 2.0, SIDE / 2.0, height + SIDE / 2.0];
    let inside = |x: [f64; 3]| {
        let distance = (0..3).map(|a| (x[a] - middle[a]).powi(2)).sum::<f64>().sqrt();
        !ball || distance < SIDE / 2.0
    };
    let places = fill(dx, [0.0, 0.0, height], [SIDE, SIDE, SIDE + height], inside);
    let mut w = world(vec![body((5e5, 0.3), 1000.0, dx, places, |_| [0.0; 3])], dx);
    w.gravity = [0.0, 0.0, -G as f32];
    w.colliders = vec![ground(0.0, 0.0)];
    (w, height)
}

fn energy(s: &Lagrangian, bodies: &[Body]) -> f64 {
    (0..bodies.len()).map(|i| s.measure(i).unwrap()).map(|m| m.kinetic + m.elastic + G * m.height).sum()
}

/// Largest and last gain over what it fell with, and the substeps.
fn bounce(gpu: &Gpu, (w, height): &(World, f64)) -> (f64, f64, u32) {
    let mut s = solver(gpu, w);
    let (start, fallen) = (energy(&s, &w.bodies), s.measure(0).unwrap().mass * G * height);
    let (mut most, mut last, mut steps) = (f64::MIN, 0.0, 0);
    let frames = (BOUNCES * 2.0 * (2.0 * height / G).sqrt() * 24.0) as u32;
    for _ in 0..frames {
        steps += s.frame(1.0 / 24.0).unwrap().substeps;
        last = (energy(&s, &w.bodies) - start) / fallen;
        most = most.max(last);
    }
    gpu.free_arena("run");
    (most, last, steps)
}

#[test]
fn thirty_bounces_make_no_energy() {
    let gpu = device::gpu();
    for (ball, cells, height) in [(false, 4.0, 0.02), (false, 8.0, 0.02), (true, 8.0, 0.02), (true, 4.0, 0.1)] {
        let case = drop(ball, cells, height);
        let (most, last, steps) = bounce(&gpu, &case);
        println!("ball {ball}, {cells} cells, {height} m: {most:+.4} at most, {last:+.4} at the end, {steps} steps");
        // Verlet's energy swings while it is pressed; half a percent a bounce is lost at the most.
        assert!(most < 0.01 && last > -0.2, "{most} and {last}");
    }
    // The light nodes at a ragged rim do not shorten the steps of what moves at a fiftieth of its waves' speed: the
    // Courant number alone would make 1.15 times as many steps as frames and the waves ask for at rest.
    let case = drop(true, 8.0, 0.02);
    let waves = f64::from(case.0.courant * case.0.dx / case.0.wave_speeds().1);
    let (_, _, steps) = bounce(&gpu, &case);
    let least = BOUNCES * 2.0 * (2.0 * case.1 / G).sqrt() / waves;
    assert!(f64::from(steps) < 1.3 * least, "{steps} steps, {least} by the waves");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Control: with a pressure that begins at once, and gives all of it back, errors of each touch add up.
#[test]
fn with_a_kink_they_do() {
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), "lagrangian/contact", "override SOFT: f32 = 0.06;", "override SOFT: f32 = 1e-6;");
    folder::edit(copy.path(), "lib/give", "const LOSS: f32 = 0.3;", "const LOSS: f32 = 0.0;");
    let gpu = device::open(Options { wgsl: Some(copy.path().into()), ..device::options() });
    let (most, last, _) = bounce(&gpu, &drop(false, 8.0, 0.02));
    println!("with a kink: {most:+.4} at most, {last:+.4} at the end");
    assert!(most > 0.05, "{most}");
}

//! Obstacles narrower than a soft body: its surface stretches around them, and what is inside is met as well.

use physvideo::world::World;
use physvideo_gpu::kernels::Collider;
use physvideo_gpu::kernels::family::shape::{BALL, BOX};
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::{device, folder};

use super::setup::{body, center, fill, particles, solver, world};

const SIDE: f64 = 0.2;
const G: f64 = 9.81;

fn ball(friction: f32) -> Collider {
    Collider { shape: BALL, end: 1e9, friction, size: [0.05, 0.0, 0.0, 0.0], ..Default::default() }
}

/// A post of 6 cm.
fn post(friction: f32) -> Collider {
    let (center, size) = ([0.0, 0.0, -0.45, 0.0], [0.03, 0.03, 0.5, 0.0]);
    Collider { shape: BOX, end: 1e9, friction, center, size, ..Default::default() }
}

/// A jelly that falls 15 cm onto an obstacle whose top is at z = 0.05, a little off its middle.
fn drop(young: f64, cells: f64, obstacle: Collider) -> World {
    let (dx, low) = (SIDE / cells, [-0.095, -0.098, 0.2]);
    let places = fill(dx, low, low.map(|c| c + SIDE), |_| true);
    let mut w = world(vec![body((young, 0.4), 1000.0, dx, places, |_| [0.0; 3])], dx);
    w.gravity = [0.0, 0.0, -G as f32];
    w.colliders = vec![obstacle];
    w
}

struct Fall {
    /// Of the deepest particle in the obstacle [m].
    deepest: f64,
    /// Of the middle of the body [m], each 40 ms.
    heights: Vec<f64>,
    /// Largest energy over that at the start.
    most: f64,
    faults: u32,
}

/// Its first 0.6 seconds.
fn run(gpu: &Gpu, w: &World) -> Fall {
    let mut s = solver(gpu, w);
    let energy = |s: &physvideo::stages::lagrangian::Lagrangian| {
        let m = s.measure(0).unwrap();
        m.kinetic + m.elastic + G * m.height
    };
    let start = energy(&s);
    let mut fall = Fall { deepest: 0.0, heights: Vec::new(), most: 0.0, faults: 0 };
    for _ in 0..15 {
        let stats = s.frame(0.04).unwrap();
        fall.faults += stats.rejected + stats.quarantined + stats.clamped_velocity;
        let all = particles(gpu, &s);
        fall.heights.push(center(&all, |_| true)[2]);
        fall.most = fall.most.max(energy(&s) / start);
        for p in &all {
            let (x, c) = (p.x.map(f64::from), &w.colliders[0]);
            let side = |a: usize| f64::from(c.size[a]) - (x[a] - f64::from(c.center[a])).abs();
            let inside = match c.shape {
                BALL => f64::from(c.size[0]) - x.iter().map(|c| c * c).sum::<f64>().sqrt(),
                _ => (0..3).map(side).fold(f64::MAX, f64::min),
            };
            fall.deepest = fall.deepest.max(inside);
        }
    }
    gpu.free_arena("run");
    fall
}

fn lowest(fall: &Fall) -> f64 {
    fall.heights.iter().copied().fold(f64::MAX, f64::min)
}

/// What it fell on stays outside, and it jumps off again; the softest where the ball has five cells, for with three it would not.
#[test]
fn a_soft_body_stays_on_a_narrow_obstacle() {
    let gpu = device::gpu();
    let soft = [(3e4, 6.0, ball(0.3)), (4e4, 10.0, post(0.3)), (1e4, 10.0, ball(0.3)), (1e4, 10.0, ball(0.0))];
    let firm = [(4e4, 6.0, ball(0.0)), (4e4, 6.0, post(0.0)), (1e6, 4.0, post(0.3))];
    for (young, cells, obstacle) in soft.into_iter().chain(firm) {
        let fall = run(&gpu, &drop(young, cells, obstacle));
        let deep = fall.deepest * cells / SIDE;
        let last = fall.heights.last().copied().unwrap_or_default();
        println!(
            "{young:.0e} Pa, {cells} cells, shape {}: {deep:.2} cells deep, lowest {:.3} m, last {last:.3}, energy {:.4}",
            obstacle.shape,
            lowest(&fall),
            fall.most
        );
        assert_eq!(fall.faults, 0);
        // Points are met from their middle on, a fifth power holds them at half a cell.
        assert!(deep < 0.8 && lowest(&fall) > -SIDE / 2.0 && last > 0.05, "{deep} cells, {:?}", fall.heights);
        // Nothing is made at edges, which faces meet where they are.
        assert!(fall.most < 1.01, "{}", fall.most);
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// A finer grid moves as a coarser one does.
#[test]
fn how_it_gives_way_does_not_depend_on_the_grid() {
    let gpu = device::gpu();
    let [coarse, fine] = [10.0, 14.0].map(|cells| run(&gpu, &drop(1e4, cells, ball(0.0))).heights);
    println!("10 cells {coarse:.3?}, 14 cells {fine:.3?}");
    // It sinks by more than its own height, and rises from there; later it turns on the ball.
    assert!(coarse.iter().zip(&fine).take(10).all(|(a, b)| (a - b).abs() < 0.02 * SIDE), "{coarse:?} and {fine:?}");
}

/// Controls: by its surface alone it lets them in; where faces take an obstacle to be flat between them and their points, edges
/// make energy.
#[test]
fn by_its_surface_alone_it_does_not() {
    let changed = |file: &str, from: &str, to: &str| {
        let copy = tempfile::tempdir().unwrap();
        folder::copy_kernels(copy.path());
        folder::edit(copy.path(), file, from, to);
        (device::open(Options { wgsl: Some(copy.path().into()), ..device::options() }), copy)
    };
    let (gpu, _copy) = changed("lagrangian/core", "let press = area *", "let press = 0.0 *");
    let fall = run(&gpu, &drop(3e4, 6.0, ball(0.3)));
    println!("by its surface alone: lowest {:.3} m", lowest(&fall));
    assert!(lowest(&fall) < -2.0 * SIDE, "{:?}", fall.heights);
    let (gpu, _copy) = changed("lagrangian/contact", "if (CURVED) {", "if (false) {");
    let fall = run(&gpu, &drop(1e6, 4.0, post(0.3)));
    println!("flat between points and faces: energy {:.3}, {} faults", fall.most, fall.faults);
    assert!(fall.most > 1.05 && fall.faults > 0, "{}", fall.most);
}

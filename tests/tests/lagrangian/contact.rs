//! Contact with obstacles by compliant points at the surface.

use physvideo::stages::lagrangian::Lagrangian;
use physvideo::world::{World, ground};
use physvideo_gpu::kernels::{Collider, Field};
use physvideo_tests::device::gpu;

use super::setup::{body, center, fill, particles, solver, world};

const G: f64 = 9.81;
/// Time in which weights come on [s], some ten times the slowest vibration of the block.
const SETTLE: f64 = 0.2;

/// A block of 4³ cells of 1/16 m on a ground at z = 0 with friction, and what acts on it.
fn block(young: f64, height: f64, velocity: [f32; 3], friction: f32) -> World {
    let dx = 1.0 / 16.0;
    let cube = fill(dx, [0.0, 0.0, height], [0.25, 0.25, 0.25 + height], |_| true);
    let mut w = world(vec![body((young, 0.3), 1000.0, dx, cube, |_| velocity)], dx);
    w.colliders = vec![ground(0.0, friction)];
    w.gravity = [0.0, 0.0, -G as f32];
    w
}

/// Kinetic, elastic and potential energy [J].
fn energy(s: &Lagrangian) -> f64 {
    let m = s.measure(0).unwrap();
    m.kinetic + m.elastic + G * m.height
}

fn lowest(gpu: &physvideo_gpu::Gpu, s: &Lagrangian) -> f64 {
    particles(gpu, s).iter().map(|p| f64::from(p.x[2])).fold(f64::MAX, f64::min)
}

/// It falls, rebounds with most of its speed, sinks no deeper than the pressure of the impact says, and gains nothing.
#[test]
fn a_block_rebounds() {
    let gpu = gpu();
    let w = block(5e5, 0.02, [0.0, 0.0, -1.0], 0.3);
    let mut s = solver(&gpu, &w);
    let start = energy(&s);
    let (mut deepest, mut fastest) = (f64::MAX, f64::MIN);
    for _ in 0..15 {
        let stats = s.frame(0.01).unwrap();
        assert_eq!(stats.rejected + stats.clamped_velocity + stats.quarantined, 0, "{stats:?}");
        // Verlet's energy swings by (ω dt)²/4 of the fastest vibrations: up to a tenth of the 7.8 J of the fall.
        assert!(energy(&s) < start + 0.1 * 7.8, "{} of {start}", energy(&s));
        let m = s.measure(0).unwrap();
        (deepest, fastest) = (deepest.min(lowest(&gpu, &s)), fastest.max(m.momentum[2] / m.mass));
    }
    println!(
        "rebound: {fastest:.3} of 1.18 m/s, lowest point {deepest:.4} m of 0.0156, energy {:.4}",
        energy(&s) / start
    );
    // It hits at sqrt(1 + 2 g 0.02) = 1.18 m/s. The half that vibrates is lost to the rebound.
    assert!(fastest > 0.7 * 1.18, "{fastest} m/s");
    // p = ρ c v and k = 1.5 ρ c²/dx: a depth of v/(1.5 c) dx = 0.03 dx, 0.03 dx more as it begins softly, and the lowest
    // cell is squeezed as well.
    assert!(deepest > 1.0 / 64.0 - 0.11 / 16.0, "{deepest} m");
    // Control: without a ground it falls on.
    let mut free = w.clone();
    free.colliders.clear();
    let mut s = solver(&gpu, &free);
    s.frame(0.15).unwrap();
    assert!(lowest(&gpu, &s) < -0.15);
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// M8: a column at rest under its weight: σ(Y) = −ρ g (H − Y) at each particle's height, for ν = 0 without side walls.
#[test]
fn a_column_carries_its_weight() {
    let gpu = gpu();
    let (dx, high, young, density) = (0.005, 0.1, 1e6, 1800.0);
    // Four particles wide: where it is thin, stress follows the boxes, and pushes at single points disturb it near the base.
    let column = fill(dx, [0.0; 3], [2.0 * dx, 2.0 * dx, high], |_| true);
    let at_rest = column.clone();
    let mut w = world(vec![body((young, 0.0), density, dx, column, |_| [0.0; 3])], dx);
    w.colliders = vec![ground(0.0, 0.0)];
    // Comes on over many periods 4 H/c, so that little is left to swing.
    let period = 4.0 * high / (young / density).sqrt();
    let ramp = 12.0 * period;
    let weight =
        |g: f64| Field { kind: 1, end: 1e9, ramp: ramp as f32, a: [0.0, 0.0, -g as f32, 0.0], ..Default::default() };
    let stress = |g: f64, w: &World| {
        let mut w = w.clone();
        w.fields = vec![weight(g)];
        let mut s = solver(&gpu, &w);
        s.frame(ramp as f32).unwrap();
        let mut sum = vec![0.0; at_rest.len()];
        for _ in 0..16 {
            s.frame((period / 16.0) as f32).unwrap();
            let all = gpu.read(physvideo::stages::solver::Solver::deformations(&s)).unwrap();
            sum.iter_mut().zip(&all).for_each(|(s, d)| *s += young * (f64::from(d.f2[2]) - 1.0) / 16.0);
        }
        sum
    };
    let worst = |stress: &[f64]| {
        let exact = |x: &[f32; 3]| -density * G * (high - f64::from(x[2]));
        stress.iter().zip(&at_rest).map(|(s, x)| (s - exact(x)).abs()).fold(0.0, f64::max) / (density * G * high)
    };
    let got = worst(&stress(G, &w));
    println!("column: {:.3} % of the pressure at the base", 100.0 * got);
    // The two points of the lowest and the highest cell miss by ρ g dx/12, 0.42 % here.
    assert!(got < 5e-3, "{got}");
    // Control: a hundredth more weight shows.
    assert!(worst(&stress(1.01 * G, &w)) > 5e-3);
}

/// On a ground under a tilted gravity of slope `slope`, the path [m] in half a second once the weight is there.
fn slide(slope: f64, friction: f32) -> f64 {
    let gpu = gpu();
    let mut w = block(5e5, 0.0, [0.0; 3], friction);
    let g = G / slope.hypot(1.0);
    // The weight comes on slowly, so that the block does not hop.
    w.gravity = [0.0; 3];
    let a = [(g * slope) as f32, 0.0, -g as f32, 0.0];
    w.fields = vec![Field { kind: 1, end: 1e9, ramp: SETTLE as f32, a, ..Default::default() }];
    let mut s = solver(&gpu, &w);
    let place = |s: &Lagrangian| center(&particles(&gpu, s), |_| true)[0];
    s.frame(SETTLE as f32).unwrap();
    let before = place(&s);
    s.frame(0.5).unwrap();
    place(&s) - before
}

/// It slips if and only if tan θ > μ, and then by g (sin θ − μ cos θ).
#[test]
fn friction_holds_up_to_its_coefficient() {
    let (mu, dx) = (0.3_f64, 1.0 / 16.0);
    let held = slide(0.27, mu as f32);
    println!("friction: {held:.5} m below the limit");
    // A tenth less than the limit lets some points slip now and then: likely it rocks, undamped, on its springs (not isolated).
    assert!(held.abs() < 0.04 * dx, "{held} m");
    let slips = slide(0.40, mu as f32);
    let a = G * (0.40 - mu) / 0.40_f64.hypot(1.0);
    // The ramp 3s² − 2s³ has half the impulse of the full weight.
    let exact = 0.5 * a * 0.25 + 0.5 * a * SETTLE * 0.5;
    println!("friction: {slips:.4} of {exact:.4} m above the limit");
    assert!((slips / exact - 1.0).abs() < 0.05, "{slips} of {exact} m");
}

/// Without friction it slides as on ice; with stickiness not at all (controls of each other).
#[test]
fn ice_and_glue() {
    let free = slide(0.2, 0.0);
    let exact = G * 0.2 / 0.2_f64.hypot(1.0) * (0.125 + 0.25 * SETTLE);
    assert!((free / exact - 1.0).abs() < 0.01, "{free} of {exact}");
    let gpu = gpu();
    let mut w = block(5e5, 0.0, [0.0; 3], 0.0);
    w.gravity = [0.0, 0.0, 2.0 * G as f32]; // upwards: the ground holds it
    w.colliders[0].sticky = 1;
    let mut s = solver(&gpu, &w);
    // Points on the face touch at once or never: they begin a hair inside.
    w.colliders[0].center[2] = 1e-4;
    let mut glued = solver(&gpu, &w);
    s.frame(0.3).unwrap();
    glued.frame(0.3).unwrap();
    let height = |s: &Lagrangian| center(&particles(&gpu, s), |_| true)[2];
    assert!(height(&glued) < 0.2, "{}", height(&glued));
}

/// A moving floor takes the block along by friction; a wall that sweeps it away does not sink into it.
#[test]
fn moving_obstacles_push() {
    let gpu = gpu();
    let run = |change: &dyn Fn(&mut World)| {
        let mut w = block(5e5, 0.0, [0.0; 3], 0.5);
        change(&mut w);
        let mut s = solver(&gpu, &w);
        s.frame(0.25).unwrap();
        let before = center(&particles(&gpu, &s), |_| true);
        s.frame(0.25).unwrap();
        let all = particles(&gpu, &s);
        let after = center(&all, |_| true);
        ((after[0] - before[0]) / 0.25, all.iter().map(|p| p.x[1]).fold(f32::MAX, f32::min))
    };
    // It hops and shears, so its speed is taken over a quarter of a second.
    let (v, _) = run(&|w| w.colliders[0].velocity = [0.5, 0.0, 0.0, 0.0]);
    assert!((v - 0.5).abs() < 0.05, "the floor takes it along: {v}");
    // Control: without friction the floor leaves it where it is.
    let (v, _) = run(&|w| (w.colliders[0].velocity, w.colliders[0].friction) = ([0.5, 0.0, 0.0, 0.0], 0.0));
    assert!(v.abs() < 1e-3, "{v}");
    let (_, nearest) = run(&|w| {
        let velocity = [0.0, 1.0, 0.0, 0.0];
        let size = [0.0, 1.0, 0.0, 0.0];
        w.colliders.push(Collider {
            shape: 1,
            end: 1e9,
            center: [0.0, -0.1, 0.0, 0.0],
            size,
            velocity,
            ..Default::default()
        });
    });
    assert!(nearest > 0.4 - 0.01, "the wall is at 0.4 m, the block at {nearest}");
}

/// 40 m/s on a jelly whose waves run at 26 m/s: the body survives and bounces, and no energy is made.
#[test]
fn a_hard_impact_is_survived() {
    let gpu = gpu();
    let w = block(5e5, 0.05, [0.0, 0.0, -40.0], 0.3);
    let mut s = solver(&gpu, &w);
    let start = energy(&s);
    let mut all = Vec::new();
    for _ in 0..8 {
        all.push(s.frame(0.005).unwrap());
    }
    let m = s.measure(0).unwrap();
    println!("impact: energy {:.3}, up at {:.1} m/s, {all:?}", energy(&s) / start, m.momentum[2] / m.mass);
    // The shock takes half of the energy; without its pressure points fold over, and there is half as much again.
    let up = m.momentum[2] / m.mass;
    assert!(energy(&s) < 0.7 * start && (10.0..40.0).contains(&up), "{} of {start} J, {up} m/s", energy(&s));
    assert!(particles(&gpu, &s).iter().all(|p| p.x.iter().all(|c| c.abs() < 2.0)));
}

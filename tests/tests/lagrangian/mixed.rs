//! Elastic bodies on grids of their own beside bodies on the shared grid (MPM), in one scene.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::stages::solver::{FrameStats, Measure, Solver};
use physvideo::world::{Body, Emission, World, ground};
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Particle;
use physvideo_tests::device::gpu;

use super::setup::{body, center, fill, world};

const G: f64 = 9.81;
const DX: f64 = 1.0 / 16.0;
/// E = 1e5 Pa, ν = 0.3, ρ = 1000 kg/m³: waves of 11.6 m/s.
const JELLY: (f64, f64) = (1e5, 0.3);

fn block(low: [f64; 3], high: [f64; 3], velocity: [f32; 3]) -> Body {
    body(JELLY, 1000.0, DX, fill(DX, low, high, |_| true), |_| velocity)
}

fn ball(center: [f64; 3], radius: f64, density: f64, velocity: [f32; 3]) -> Body {
    let inside = |x: [f64; 3]| (0..3).map(|a| (x[a] - center[a]).powi(2)).sum::<f64>() < radius * radius;
    let box_of = |way: f64| center.map(|c| c + way * radius);
    body(JELLY, density, DX, fill(DX, box_of(-1.0), box_of(1.0), inside), |_| velocity)
}

/// The bodies of a world that are on grids of their own by `own`.
fn solver<'g>(gpu: &'g Gpu, w: &World, own: &[bool]) -> Mpm<'g> {
    Mpm::beside(gpu, w, Method::default(), own).unwrap()
}

fn clean(stats: &FrameStats) {
    assert_eq!(stats.rejected + stats.clamped_velocity + stats.quarantined, 0, "{stats:?}");
}

fn velocity(m: &Measure) -> [f64; 3] {
    m.momentum.map(|p| p / m.mass)
}

fn size(v: [f64; 3]) -> f64 {
    v.iter().map(|c| c * c).sum::<f64>().sqrt()
}

fn particles(gpu: &Gpu, s: &Mpm) -> Vec<Particle> {
    gpu.read(s.particles).unwrap()
}

/// A ball at 1 m/s meets another at rest, no gravity: the momentum at the start, sums at the end, the largest energy and
/// that at the end over the first. `own`: which is on a grid of its own.
fn collide(gpu: &Gpu, own: [bool; 2]) -> ([f64; 3], [Measure; 2], f64, f64) {
    let mut w = world(
        vec![ball([0.5, 0.52, 0.47], 0.25, 1000.0, [1.0, 0.1, 0.0]), ball([1.07, 0.5, 0.5], 0.25, 1000.0, [0.0; 3])],
        DX,
    );
    w.domain = ([-2.0; 3], [4.0; 3]);
    let mut s = if own == [false; 2] { Mpm::new(gpu, &w, Method::default()).unwrap() } else { solver(gpu, &w, &own) };
    let start = s.measure(0).unwrap();
    let energy = |s: &Mpm| (0..2).map(|i| s.measure(i).unwrap()).map(|m| m.kinetic + m.elastic).sum::<f64>();
    let first = energy(&s);
    let mut most: f64 = 0.0;
    for _ in 0..20 {
        clean(&s.frame(0.02).unwrap());
        most = most.max(energy(&s) / first);
    }
    println!("{own:?}: energy {:.4}, at most {most:.4}", energy(&s) / first);
    (start.momentum, [s.measure(0).unwrap(), s.measure(1).unwrap()], most, energy(&s) / first)
}

/// K5 and the exchange of momentum: balls of equal mass, one on a grid of its own, against both on the shared grid, which
/// loses a quarter of the energy on the way; without loss they would exchange their velocities.
#[test]
fn balls_exchange_momentum_as_on_one_grid() {
    let gpu = gpu();
    let (_, both, ..) = collide(&gpu, [false; 2]);
    for own in [[true, false], [false, true]] {
        let (start, ends, most, last) = collide(&gpu, own);
        let total: [f64; 3] = std::array::from_fn(|a| ends[0].momentum[a] + ends[1].momentum[a]);
        let apart = |p: [f64; 3]| size(std::array::from_fn(|a| p[a] - start[a])) / size(start);
        let (a, b) = (velocity(&ends[0]), velocity(&ends[1]));
        println!(
            "own {own:?}: {a:.3?} and {b:.3?}, on one grid {:.3?} and {:.3?}; momentum off by {:.1e}",
            velocity(&both[0]),
            velocity(&both[1]),
            apart(total)
        );
        assert!(apart(total) < 1e-5, "{total:?} of {start:?}");
        // Control: of one body alone it is not kept.
        assert!(apart(ends[0].momentum) > 0.5);
        assert!((velocity(&both[1])[0] - 0.03..1.0).contains(&b[0]) && a[0] > 0.0, "{a:?}, {b:?}");
        // While they touch, the work that the springs have taken is taken by velocities from before their push, and by some
        // that lie half a step beside their places: a tenth of the energy too much, and none of it is left in the end.
        assert!(most < 1.2 && (0.9..1.0).contains(&last), "{most}, {last}");
    }
}

/// A tank of water, 0.75 m square and 0.5 m deep.
fn tank(water: impl Fn([f64; 3]) -> bool) -> (Body, Vec<physvideo_gpu::kernels::Collider>) {
    let mut liquid = body(JELLY, 1000.0, DX, fill(DX, [0.0; 3], [0.75, 0.75, 0.5], water), |_| [0.0; 3]);
    liquid.material = Material::Liquid { bulk: 2e5, exponent: 7.0, viscosity: 0.5 };
    let mut sides = vec![ground(0.0, 0.0)];
    for (axis, at, way) in [(0, 0.0, 1.0), (0, 0.75, -1.0), (1, 0.0, 1.0), (1, 0.75, -1.0)] {
        let mut wall = ground(0.0, 0.0);
        (wall.center, wall.size) = ([0.0; 4], [0.0; 4]);
        wall.center[axis] = at;
        wall.size[axis] = way;
        sides.push(wall);
    }
    (liquid, sides)
}

/// A block of 0.25 m in water: how deep its lower face is below the water's rest level in the end, over its height.
fn float(gpu: &Gpu, density: f64) -> f64 {
    let (low, high) = ([0.25, 0.25, 0.375], [0.5, 0.5, 0.625]);
    let inside = move |x: [f64; 3]| (0..3).all(|a| x[a] > low[a] && x[a] < high[a]);
    let (liquid, sides) = tank(|x| !inside(x));
    let mut wood = block(low, high, [0.0; 3]);
    wood.density = density as f32;
    let mut w = world(vec![wood, liquid], DX);
    (w.colliders, w.gravity, w.domain) = (sides, [0.0, 0.0, -G as f32], ([-0.2; 3], [1.0, 1.0, 1.5]));
    let mut s = solver(gpu, &w, &[true, false]);
    let each = w.bodies[0].positions.len();
    let (mut drafts, mut rejected) = (Vec::new(), 0);
    for _ in 0..40 {
        rejected += s.frame(0.05).unwrap().rejected;
        let all = particles(gpu, &s);
        let bottom = center(&all, |i| i < each)[2] - 0.125;
        let middle = center(&all, |i| i >= each)[2];
        // The water's level L by its mean height (its pressure squeezes it by some percent): ∫ z over the tank's face A up
        // to L, less the block's face a from its lower end b on, over the same of 1.
        let (tank, face) = (0.75 * 0.75, 0.0625);
        let height = |l: f64| {
            let under = (l - bottom.max(0.0)).clamp(0.0, 0.25);
            let block = under * (bottom.max(0.0) + under / 2.0);
            (tank * l * l / 2.0 - face * block) / (tank * l - face * under)
        };
        let (mut low, mut high) = (0.2, 1.0);
        for _ in 0..50 {
            let l = (low + high) / 2.0;
            *if height(l) < middle { &mut low } else { &mut high } = l;
        }
        drafts.push((low - bottom) / 0.25);
    }
    let mean = drafts[20..].iter().sum::<f64>() / 20.0;
    println!("{density} kg/m³: draft {mean:.3}, {rejected} attempts taken back");
    mean
}

/// Archimedes: a block sinks in by the share of its density, and one that is heavier than water to the bottom. The level is
/// smeared over a cell, a quarter of the block.
#[test]
fn a_body_floats_by_archimedes() {
    let gpu = gpu();
    for share in [0.5, 0.25] {
        let draft = float(&gpu, 1000.0 * share);
        assert!((draft / share - 1.0).abs() < 0.15, "{draft} of {share}");
    }
    assert!(float(&gpu, 2000.0) > 1.8);
}

/// A block of that density on a bed of sand, 4 cells deep: how far it has sunk after 0.6 s and after 1.2 s, in the mean over
/// 0.2 s, and the sum of what was taken back or limited.
fn rest(gpu: &Gpu, density: f64) -> ([f64; 2], u32) {
    let mut sand = body((1e6, 0.3), 1600.0, DX, fill(DX, [0.0; 3], [0.75, 0.75, 0.25], |_| true), |_| [0.0; 3]);
    sand.material = Material::Sand { young: 1e6, poisson: 0.3, friction: 0.7 };
    let mut stone = block([0.25, 0.25, 0.25], [0.5, 0.5, 0.5], [0.0; 3]);
    stone.density = density as f32;
    let mut w = world(vec![stone, sand], DX);
    let (_, sides) = tank(|_| true);
    (w.colliders, w.gravity, w.domain) = (sides, [0.0, 0.0, -G as f32], ([-0.2; 3], [1.0, 1.0, 1.5]));
    let mut s = solver(gpu, &w, &[true, false]);
    let each = w.bodies[0].positions.len();
    let mut trouble = 0;
    let mut mean = |s: &mut Mpm| {
        let mut sum = 0.0;
        for _ in 0..10 {
            let stats = s.frame(0.02).unwrap();
            trouble += stats.rejected + stats.clamped_velocity + stats.quarantined;
            sum += 0.375 - center(&particles(gpu, s), |i| i < each)[2];
        }
        sum / 10.0
    };
    s.frame(0.4).unwrap();
    let first = mean(&mut s);
    s.frame(0.4).unwrap();
    let second = mean(&mut s);
    ([first, second], trouble)
}

/// Its weight is carried: it stays, so that the mean force is m g; and one four times as heavy lies deeper.
#[test]
fn a_bed_of_sand_carries_a_block() {
    let gpu = gpu();
    let ([first, second], trouble) = rest(&gpu, 1000.0);
    let ([heavy, _], _) = rest(&gpu, 4000.0);
    println!("block: {first:.4} m deep, then {second:.4} m; four times as heavy {heavy:.4} m; {trouble} limits");
    assert!(trouble == 0 && (0.0..DX / 2.0).contains(&second), "{second} m");
    // A mean force of m g (1 − 1/100) would be 2 cm of fall in that time.
    assert!((second - first).abs() < 0.05 * DX, "{first} m, {second} m");
    assert!(heavy > 1.5 * first, "{heavy} m");
}

/// A sheet one particle thick has one face for both sides: it lies on the sand as well as under it. How far its middle is
/// from where it lay at first after 0.3 s.
#[test]
fn a_thin_sheet_is_met_from_both_sides() {
    let gpu = gpu();
    let moved = |gravity: f64| {
        let mut bed = body((1e6, 0.3), 1600.0, DX, fill(DX, [0.0; 3], [0.5, 0.5, 0.25], |_| true), |_| [0.0; 3]);
        bed.material = Material::Sand { young: 1e6, poisson: 0.3, friction: 0.7 };
        let high = if gravity < 0.0 { 0.25 } else { -DX / 2.0 };
        let (low, up) = ([0.0, 0.0, high], [0.5, 0.5, high + DX / 2.0]);
        let sheet = body(JELLY, 1000.0, DX, fill(DX, low, up, |_| true), |_| [0.0; 3]);
        // What pulls on the sheet does not pull on the sand, which has a wall behind it.
        bed.gravity = Some([0.0; 3]);
        let mut wall = ground(if gravity < 0.0 { 0.0 } else { 0.25 }, 0.5);
        wall.size[2] = -gravity.signum() as f32;
        let mut w = world(vec![sheet, bed], DX);
        (w.gravity, w.domain) = ([0.0, 0.0, gravity as f32], ([-0.5, -0.5, -2.0], [1.0, 1.0, 2.0]));
        w.colliders = vec![wall];
        let mut s = solver(&gpu, &w, &[true, false]);
        let each = w.bodies[0].positions.len();
        let height = |s: &Mpm| center(&particles(&gpu, s), |i| i < each)[2];
        let start = height(&s);
        s.frame(0.3).unwrap();
        height(&s) - start
    };
    for gravity in [-G, G] {
        let sunk = moved(gravity) * gravity.signum();
        println!("sheet: {sunk:.4} m towards the sand under {gravity} m/s²");
        // Free it would have gone 0.44 m. Sand fills half of what a sheet leaves before it pushes, and gives way sideways.
        assert!((0.0..1.5 * DX).contains(&sunk), "{sunk} m");
    }
}

/// A block that falls on water, with which everything else is tried.
fn splash() -> World {
    let (liquid, sides) = tank(|x| x[2] < 0.25);
    let mut w = world(vec![liquid, block([0.25, 0.25, 0.3125], [0.5, 0.5, 0.5], [0.0, 0.0, -1.0])], DX);
    (w.colliders, w.gravity, w.domain) = (sides, [0.0, 0.0, -G as f32], ([-0.2; 3], [1.0, 1.0, 1.5]));
    w
}

/// A frame given up between two submissions leaves no trace, and two runs have the same bits.
#[test]
fn a_stopped_frame_leaves_no_trace() {
    let gpu = gpu();
    let w = splash();
    let run = |stops: bool| {
        let mut s = solver(&gpu, &w, &[false, true]);
        s.frame(0.1).unwrap();
        if stops {
            let asked = Arc::new(AtomicBool::new(true));
            s.stop_when(Arc::clone(&asked));
            assert!(s.frame(1.0).unwrap().stopped);
            asked.store(false, Ordering::Relaxed);
        }
        s.frame(0.1).unwrap();
        particles(&gpu, &s)
    };
    let plain = run(false);
    assert!(plain == run(false) && plain == run(true));
}

/// Steps far beyond the limit are counted and blow nothing up: all stays finite.
#[test]
fn forced_steps_are_limited_and_told() {
    let gpu = gpu();
    let mut w = splash();
    w.force_dt = Some(4.0 * w.step());
    let mut s = solver(&gpu, &w, &[false, true]);
    let all: Vec<_> = (0..10).map(|_| s.frame(0.04).unwrap()).collect();
    let told: u32 = all.iter().map(|f| f.clamped_velocity + f.clamped_strain + f.clamped_volume + f.quarantined).sum();
    assert!(told > 0 && all[0].dt.1 > 3.0 * splash().step(), "{told}, {:?}", all[0]);
    assert!(particles(&gpu, &s).iter().all(|p| p.x.iter().chain(&p.v).all(|c| c.is_finite())));
}

/// Before an emitter begins there is nothing on the shared grid, and the other body falls all the same.
#[test]
fn a_body_moves_before_anything_else_does() {
    let gpu = gpu();
    let mut w = splash();
    let emission =
        Emission { start: 0.15, end: 1.0, period: 1e9, delays: vec![0.0; w.bodies[0].positions.len()], lifetime: None };
    w.bodies[0].emission = Some(emission);
    w.bodies[0].positions.iter_mut().for_each(|x| x[0] += 1.5);
    (w.colliders, w.domain) = (vec![], ([-2.0; 3], [3.0; 3]));
    let mut s = solver(&gpu, &w, &[false, true]);
    let height = |s: &Mpm| s.measure(1).unwrap().height / s.measure(1).unwrap().mass;
    let start = height(&s);
    let substeps: u32 = (0..2).map(|_| s.frame(0.05).unwrap().substeps).sum();
    let fallen = start - height(&s);
    let exact = 0.1 + 0.5 * G * 0.01;
    println!("fallen {fallen:.6} of {exact:.6} m in {substeps} steps");
    assert!((fallen / exact - 1.0).abs() < 1e-3 && substeps > 0, "{fallen} of {exact} m");
    // And it goes on as the liquid comes out far beside it.
    let emitted: u32 = (0..2).map(|_| s.frame(0.05).unwrap().emitted).sum();
    assert!(emitted > 0 && start - height(&s) > 2.0 * fallen, "{emitted}");
}

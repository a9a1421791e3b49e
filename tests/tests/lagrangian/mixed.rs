//! Elastic bodies on grids of their own beside bodies on the shared grid (MPM), in one scene.

use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::stages::solver::{FrameStats, Measure};
use physvideo::world::{Body, World, ground};
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

/// A ball at 1 m/s meets a resting block, no gravity: momenta before and after, and the velocities after. `own`: which is on
/// a grid of its own.
fn collide(gpu: &Gpu, own: [bool; 2], courant: f32) -> ([f64; 3], [Measure; 2], f64) {
    let mut w = world(
        vec![
            ball([0.5, 0.52, 0.47], 0.25, 1000.0, [1.0, 0.1, 0.0]),
            ball([1.07, 0.5, 0.5], 0.25, 1000.0, [0.0; 3]),
        ],
        DX,
    );
    w.domain = ([-2.0; 3], [4.0; 3]);
    w.courant = courant;
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
    (start.momentum, [s.measure(0).unwrap(), s.measure(1).unwrap()], most)
}

/// K5 and the exchange of momentum: balls of equal mass, one on a grid of its own, against both on the shared grid.
#[test]
fn balls_exchange_momentum_as_on_one_grid() {
    let gpu = gpu();
    let (_, both, _) = collide(&gpu, [false; 2], 0.75);
    for own in [[true, false], [false, true]] {
        let (_, _, most) = collide(&gpu, own, 0.2);
        let (start, ends, _) = collide(&gpu, own, 0.75);
        let total: [f64; 3] = std::array::from_fn(|a| ends[0].momentum[a] + ends[1].momentum[a]);
        let off = size(std::array::from_fn(|a| total[a] - start[a])) / size(start);
        let (a, b) = (velocity(&ends[0]), velocity(&ends[1]));
        println!("own {own:?}: {a:.3?} and {b:.3?}, on one grid {:.3?} and {:.3?}; momentum off by {off:.1e}",
            velocity(&both[0]), velocity(&both[1]));
        assert!(off < 1e-5, "{off}");
        // Control: without the reaction the other would rest.
        assert!(b[0] > 0.5 && most < 1.02, "{b:?}, {most}");
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
    w.fields = vec![];
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
    println!("{density} kg/m³: draft {mean:.3}, {rejected} attempts taken back; {drafts:.3?}");
    mean
}

#[test]
fn a_body_floats_by_archimedes() {
    let gpu = gpu();
    for share in [0.5, 0.25] {
        let draft = float(&gpu, 1000.0 * share);
        println!("draft {draft:.3} of {share}");
    }
    let heavy = float(&gpu, 2000.0);
    println!("heavy {heavy:.3}");
}

/// A block on a bed of sand.
#[test]
fn a_bed_of_sand_carries_a_block() {
    let gpu = gpu();
    let mut sand = body((1e6, 0.3), 1600.0, DX, fill(DX, [0.0; 3], [0.75, 0.75, 0.25], |_| true), |_| [0.0; 3]);
    sand.material = Material::Sand { young: 1e6, poisson: 0.3, friction: 0.7 };
    let mut w = world(vec![block([0.25, 0.25, 0.25], [0.5, 0.5, 0.5], [0.0; 3]), sand], DX);
    let (_, sides) = tank(|_| true);
    (w.colliders, w.gravity, w.domain) = (sides, [0.0, 0.0, -G as f32], ([-0.2; 3], [1.0, 1.0, 1.5]));
    w.fields = vec![];
    let mut s = solver(&gpu, &w, &[true, false]);
    let each = w.bodies[0].positions.len();
    for i in 0..20 {
        let stats = s.frame(0.05).unwrap();
        let all = particles(&gpu, &s);
        if i % 2 == 1 {
            println!("{:.2} s: block at {:.4?}, {stats:?}", s.time(), center(&all, |i| i < each));
        }
    }
}

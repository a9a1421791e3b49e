//! Surface tension without weight: a box becomes a ball and stays where it is, a drop swings as Rayleigh says, momentum
//! and angular momentum stay, and a wall does not push a drop off.

use std::f64::consts::{PI, TAU};

use physvideo::scene::{Material, Pressure};
use physvideo::stages::sph::Sph;
use physvideo::world::World;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::{Field, Particle, family};
use physvideo_tests::device::gpu;
use physvideo_tests::liquid::{lattice, liquid, plane, world};
use physvideo_tests::random::Random;

const H: f64 = 1e-3;
const DENSITY: f64 = 1000.0;

/// The part of a lattice of ±10 h that `keep` keeps (places in h), without weight.
fn drop(pressure: Pressure, tension: f64, viscosity: f32, keep: impl Fn([f64; 3]) -> bool) -> World {
    let all = lattice(H, [-10.0 * H; 3], [10.0 * H; 3]);
    let kept = all.into_iter().filter(|x| keep(x.map(|c| f64::from(c) / H))).collect();
    let mut body = liquid(DENSITY as f32, viscosity, H, kept);
    body.material = Material::Sph { viscosity, surface_tension: tension as f32 };
    world(pressure, H, vec![body], [-20.0 * H; 3], [20.0 * H; 3])
}

fn ball(radius: f64) -> impl Fn([f64; 3]) -> bool {
    move |x| x.iter().map(|c| c * c).sum::<f64>() < radius * radius
}

/// Period of the second mode of a drop of `particles` (Rayleigh 1879): ω² = 8 σ/(ρ R³) [s].
fn rayleigh(particles: usize, tension: f64) -> f64 {
    let cube = particles as f64 * H.powi(3) * 3.0 / (4.0 * PI);
    TAU * (DENSITY * cube / (8.0 * tension)).sqrt()
}

/// Centre of mass [h], and the mean squares along the axes about it [h²].
fn moments(particles: &[Particle]) -> ([f64; 3], [f64; 3]) {
    let mean = |f: &dyn Fn(&Particle) -> f64| particles.iter().map(f).sum::<f64>() / particles.len() as f64;
    let center = [0, 1, 2].map(|a| mean(&|p| f64::from(p.x[a]) / H));
    (center, [0, 1, 2].map(|a| mean(&|p| (f64::from(p.x[a]) / H - center[a]).powi(2))))
}

/// Two periods of a box of 10 × 6 × 6 particles: ratio of its squares, and how far its centre moved [h].
fn rounded(pressure: Pressure, tension: f64, viscosity: f32, time: f64) -> (f64, f64) {
    let gpu = gpu();
    let w = drop(pressure, tension, viscosity, |x| x[0].abs() < 5.0 && x[1].abs() < 3.0 && x[2].abs() < 3.0);
    let mut sph = Sph::new(&gpu, &w).unwrap();
    for _ in 0..4 {
        let stats = sph.frame((time / 4.0) as f32).unwrap();
        assert_eq!((stats.clamped_velocity, stats.quarantined), (0, 0), "{pressure:?}");
    }
    let (center, squares) = moments(&gpu.read(sph.particles).unwrap());
    (squares[0] / squares[1].max(squares[2]), center.iter().map(|c| c.abs()).fold(0.0, f64::max))
}

#[test]
fn a_box_becomes_a_ball_and_stays() {
    for (pressure, tension) in [(Pressure::Dfsph, 0.072), (Pressure::Wcsph, 0.7)] {
        let time = 2.0 * rayleigh(360, tension);
        // As much of a swing is lost in a period whatever the tension.
        let viscosity = 1e-4 * (tension / 0.072).sqrt() as f32;
        let (ratio, moved) = rounded(pressure, tension, viscosity, time);
        // Of 2.8 at the start; what is left is a swing, or the last particle of a surface nine across.
        assert!((ratio - 1.0).abs() < 0.12, "{pressure:?}: its squares are as {ratio:.3} to 1");
        assert!(moved < 1e-3, "{pressure:?}: its centre moved by {moved:.1e} h");
        // Control: without tension it stays a box.
        assert!(rounded(pressure, 0.0, viscosity, time).0 > 2.7, "{pressure:?}: it rounds without tension");
    }
}

/// Half a swing of a drop that rested first, from one passage through the ball to the next [s].
fn half_swing(gpu: &Gpu, radius: f64, tension: f64) -> (f64, usize) {
    let still = drop(Pressure::Dfsph, tension, 1e-6, ball(radius));
    let count = still.bodies[0].positions.len();
    let period = rayleigh(count, tension);
    let mut damped = still.clone();
    let drag = Field { kind: family::field::WIND, end: 1e9, p0: (10.0 / period) as f32, ..Default::default() };
    damped.fields = vec![drag];
    let mut rest = Sph::new(gpu, &damped).unwrap();
    rest.frame((1.5 * period) as f32).unwrap();
    let mut particles = gpu.read(rest.particles).unwrap();
    // A flow without divergence, as the mode's.
    let rate = (0.15 * TAU / period) as f32;
    particles.iter_mut().for_each(|p| p.v = [-0.5 * rate * p.x[0], -0.5 * rate * p.x[1], rate * p.x[2]]);
    let mut sph = Sph::new(gpu, &still).unwrap();
    gpu.write(sph.particles, 0, &particles).unwrap();
    let (step, mut last, mut passed) = (period / 40.0, 0.0, Vec::new());
    for frame in 1..=50 {
        sph.frame(step as f32).unwrap();
        let (_, m) = moments(&gpu.read(sph.particles).unwrap());
        let stretch = m[2] - 0.5 * (m[0] + m[1]);
        if last * stretch < 0.0 {
            passed.push(step * (f64::from(frame) - stretch / (stretch - last)));
        }
        last = stretch;
    }
    assert!(passed.len() >= 2, "it does not swing: {passed:?}");
    (passed[1] - passed[0], count)
}

#[test]
fn a_drop_swings_as_rayleigh_says() {
    let gpu = gpu();
    let (half, count) = half_swing(&gpu, 7.0, 0.072);
    let off = |tension: f64| 2.0 * half / rayleigh(count, tension) - 1.0;
    // The kernel's constant is measured on this. With the order of the particles the period scatters: it is 0.87 to 0.99
    // of Rayleigh's at a radius of 6 h, 0.97 at 7 h and 0.98 at 8 h.
    assert!(off(0.072).abs() < 0.08, "{:+.3} of the period", off(0.072));
    // Control: twice the tension, or half of it, is told apart.
    assert!(off(0.144).abs() > 0.25 && off(0.036).abs() > 0.2, "any tension passes");
}

#[test]
fn momentum_and_angular_momentum_stay() {
    for (pressure, tension) in [(Pressure::Dfsph, 0.072), (Pressure::Wcsph, 0.7)] {
        let gpu = gpu();
        let mut w = drop(pressure, tension, 0.0, ball(4.0));
        let mut random = Random::new(7);
        let speed = (tension / (DENSITY * 4.0 * H)).sqrt() as f32;
        w.bodies[0].velocities.iter_mut().for_each(|v| *v = random.vector(0.3 * speed));
        let mut sph = Sph::new(&gpu, &w).unwrap();
        let before = sph.measure(0).unwrap();
        sph.frame((0.5 * rayleigh(251, tension)) as f32).unwrap();
        let after = sph.measure(0).unwrap();
        let apart = |a: [f64; 3], b: [f64; 3]| (0..3).map(|i| (a[i] - b[i]).abs()).fold(0.0, f64::max);
        // Of the momentum of all particles at that speed; forces of the surface are hundreds of times those at rest.
        let moved = before.mass * f64::from(speed);
        let (p, l) =
            (apart(before.momentum, after.momentum) / moved, apart(before.spin, after.spin) / (moved * 4.0 * H));
        assert!(p < 2e-5, "{pressure:?}: momentum changed by {p:.1e}");
        assert!(l < 2e-4, "{pressure:?}: angular momentum changed by {l:.1e}");
    }
}

/// Half a ball on a wall that lets slip: the wall is its mirror, so it stays half a ball. Without the walls' part of the
/// surface it would gather to a ball and jump.
#[test]
fn half_a_ball_stays_on_a_wall() {
    let gpu = gpu();
    let mut w = drop(Pressure::Dfsph, 0.072, 1e-5, |x| x[2] > 0.0 && ball(6.0)(x));
    w.colliders = vec![plane([0.0; 3], [0.0, 0.0, 1.0], false)];
    let start =
        moments(&w.bodies[0].positions.iter().map(|x| Particle { x: *x, ..Default::default() }).collect::<Vec<_>>());
    let mut sph = Sph::new(&gpu, &w).unwrap();
    for _ in 0..4 {
        let stats = sph.frame((0.5 * rayleigh(912, 0.072)) as f32).unwrap();
        assert_eq!((stats.clamped_velocity, stats.quarantined), (0, 0));
    }
    let particles = gpu.read(sph.particles).unwrap();
    let (center, squares) = moments(&particles);
    let lowest = particles.iter().map(|p| f64::from(p.x[2]) / H).fold(f64::MAX, f64::min);
    assert!(lowest > 0.0 && lowest < 1.0, "the lowest particle is {lowest:.2} h above the wall");
    assert!((center[2] / start.0[2] - 1.0).abs() < 0.15, "centre at {:.2} h, of {:.2}", center[2], start.0[2]);
    assert!((squares[0] / start.1[0] - 1.0).abs() < 0.2, "{squares:.2?} of {:.2?}", start.1);
}

//! S1 and S2 for the liquid of the grid: a tank at rest, and a dam that breaks (Martin & Moyce 1952), planar.

use physvideo::scene::Material;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Field;
use physvideo_gpu::kernels::family::field::WIND;

use super::deposit::Pool;
use super::setup::{Lattice, Play};
use super::{Outcome, Problem, Setting, elastic};

const DENSITY: f64 = 1000.0;
const GRAVITY: f64 = 9.81;
/// Exponent of the equation of state.
const GAMMA: f64 = 7.0;

/// Cells above the floor where pressure is right: in the two below, the held nodes press some layers together and
/// spare others, by half of the pressure whatever the resolution.
const FLOOR: f64 = 2.0;

/// The tank.
pub const TANK: Problem = Problem {
    id: "S1-mpm",
    title: "liquid at rest, cells along its depth: pressure against ρg × depth two cells off the floor, rms, over that of the base",
    goal: 1e-2,
    methods: &["updated_lagrangian", "mls"],
    resolutions: &[6, 8, 12, 16, 24],
    courants: &elastic::COURANTS,
    run: |gpu, setting| rest(gpu, setting, DENSITY),
};

/// The dam.
pub const DAM: Problem = Problem {
    id: "S2-mpm",
    title: "dam break of a liquid, cells along its width: front against the middle of the measured band, mean of 8 instants",
    goal: 0.05,
    methods: &["updated_lagrangian", "mls"],
    resolutions: &[8, 12, 16, 24, 32],
    courants: &elastic::COURANTS,
    run: |gpu, setting| dam(gpu, setting, 1.0).map(|(outcome, _)| outcome),
};

/// A liquid with a speed of sound of ten times what falls from `high` [m].
fn water(high: f64) -> (Material, f64) {
    let bulk = DENSITY * 100.0 * 2.0 * GRAVITY * high;
    (Material::Liquid { bulk: bulk as f32, exponent: GAMMA as f32, viscosity: 0.0 }, bulk)
}

/// A tank of liquid of some density comes to rest, against ρ = 1000.
///
/// # Errors
/// The device's refusal.
pub fn rest(gpu: &Gpu, setting: Setting, density: f64) -> Result<Outcome, String> {
    let deep = 0.1;
    let lattice = Lattice::of(setting.method, deep / f64::from(setting.resolution));
    let (material, bulk) = water(deep);
    let mut pool = Pool::new(lattice, material, density, [deep, deep], true, deep + lattice.dx);
    pool.world.gravity = [0.0, 0.0, -GRAVITY as f32];
    pool.world.courant = setting.courant;
    // Drag about critical for sloshing; twelve of its times leave exp(−12).
    let rate = (GRAVITY / deep).sqrt();
    pool.world.fields = vec![Field { kind: WIND, end: 1e9, p0: (2.0 * rate) as f32, ..Default::default() }];
    let mut play = Play::new(gpu, &pool.world, setting.method)?;
    for _ in 0..4 {
        play.frame(3.0 / rate)?;
    }
    let (particles, deformations) = (play.particles()?, play.deformations()?);
    // The surface is half a layer above the layer that was the highest.
    let highest = pool.places.iter().zip(&particles).filter(|(x, _)| x[2] > deep - pool.behind - pool.layer);
    let (heights, high) = highest.fold((0.0, 0.0), |(s, n), (_, p)| (s + f64::from(p.x[2]), n + 1.0));
    let level = heights / high + 0.5 * pool.layer;
    let base = DENSITY * GRAVITY * deep;
    let (mut sum, mut count) = (0.0, 0.0);
    for (p, d) in particles.iter().zip(&deformations).filter(|(p, _)| f64::from(p.x[2]) > FLOOR * lattice.dx) {
        let pressure = bulk / GAMMA * (f64::from(d.f0[0]).min(1.0).powf(-GAMMA) - 1.0);
        sum += ((pressure - DENSITY * GRAVITY * (level - f64::from(p.x[2]))) / base).powi(2);
        count += 1.0;
    }
    let error = f64::sqrt(sum / count);
    Ok(play.finish(error))
}

/// What counts as front: where the liquid is this share of the column's width high, 2.3 mm. A film that is thinner the finer
/// the cells are is none.
const FRONT: f64 = 0.04;

/// Front over width at T = t sqrt(2g/a), of two measured sets and two digitisations: T, least, most.
pub const BAND: [(f64, f64, f64); 8] = [
    (0.85, 1.226, 1.305),
    (1.2, 1.436, 1.552),
    (1.5, 1.747, 1.855),
    (2.0, 2.296, 2.354),
    (2.55, 2.837, 3.105),
    (3.0, 3.466, 3.790),
    (3.6, 4.434, 4.531),
    (4.0, 4.904, 5.115),
];

/// A column of liquid, twice as high as wide, is let go under `pull` times gravity; also the fronts over its width.
///
/// # Errors
/// The device's refusal.
pub fn dam(gpu: &Gpu, setting: Setting, pull: f64) -> Result<(Outcome, Vec<f64>), String> {
    // 2.25 inches.
    let wide = 0.057_15;
    let lattice = Lattice::of(setting.method, wide / f64::from(setting.resolution));
    let high = 2.0 * wide;
    let (material, _) = water(high);
    let mut pool = Pool::new(lattice, material, DENSITY, [wide, high], false, 7.0 * wide);
    pool.world.gravity = [0.0, 0.0, (-pull * GRAVITY) as f32];
    pool.world.courant = setting.courant;
    // Water does not slip along a floor; where it may, the front runs 12 % ahead of the band and not 5.
    pool.world.colliders[0].sticky = 1;
    let mut play = Play::new(gpu, &pool.world, setting.method)?;
    let unit = (wide / (2.0 * GRAVITY)).sqrt();
    let (mut fronts, mut last, mut error) = (Vec::new(), 0.0, 0.0);
    for (time, least, most) in BAND {
        play.frame((time - last) * unit)?;
        last = time;
        let front = pool.profile(&play.particles()?).front(FRONT * wide) / wide;
        let middle = 0.5 * (least + most);
        error += (front / middle - 1.0).abs() / BAND.len() as f64;
        fronts.push(front);
    }
    Ok((play.finish(error), fronts))
}

//! M9: a column of sand collapses along a rough floor, planar, from a wall it slides along: L₀ is its width from the
//! wall, and it is a = 2 times as high. Run-out (L∞ − L₀)/L₀ is 1.2 a (Lube 2005) to 1.8 a (Lajeunesse 2005), and the
//! deposit's height over L₀ from 0.83 (Lagrée 2011, μ(I) simulation) to 1.32 (Lube 2005).

use physvideo::scene::Material;
use physvideo::world::ground;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Particle;

use super::deposit::Pool;
use super::setup::{Lattice, Play};
use super::{Outcome, Problem, Setting, elastic};

/// Width [m].
const WIDTH: f64 = 0.1;
const ASPECT: f64 = 2.0;
/// Run-outs that experiments span.
pub const RUN_OUT: std::ops::RangeInclusive<f64> = 2.4..=3.6;
/// Heights of deposits that experiments and simulations span.
pub const HEIGHT: std::ops::RangeInclusive<f64> = 0.83..=1.32;
/// Of the sand inside and along the floor.
pub const FRICTION: f32 = 0.45;

/// The column.
pub const COLUMN: Problem = Problem {
    id: "M9",
    title: "sand column, cells along its width: run-out against 3, the middle of the experiments' 2.4 to 3.6",
    goal: 0.2,
    methods: &["updated_lagrangian", "mls"],
    resolutions: &[6, 8, 12, 16, 24],
    courants: &elastic::COURANTS,
    run: |gpu, setting| collapse(gpu, setting, FRICTION).map(|c| c.outcome),
};

/// What is left of a column.
#[derive(Clone, Copy, Debug)]
pub struct Collapse {
    /// Of the run-out.
    pub outcome: Outcome,
    /// (L∞ − L₀)/L₀.
    pub run_out: f64,
    /// H∞/L₀.
    pub height: f64,
    /// Kinetic energy at the end over the potential energy at the start.
    pub motion: f64,
}

/// How far a deposit reaches [m]: all but the outermost fiftieth of it. Those are single grains in a layer thinner than a
/// cell, which come to rest here or a few cells further, and which an experiment would not call its front.
fn reach(particles: &[Particle]) -> f64 {
    let mut x: Vec<f64> = particles.iter().map(|p| f64::from(p.x[0])).collect();
    x.sort_by(f64::total_cmp);
    x[x.len() - 1 - x.len() / 50]
}

/// A column of sand of some friction, until it lies still.
///
/// # Errors
/// The device's refusal.
pub fn collapse(gpu: &Gpu, setting: Setting, friction: f32) -> Result<Collapse, String> {
    let lattice = Lattice::of(setting.method, WIDTH / f64::from(setting.resolution));
    let high = ASPECT * WIDTH;
    // Stiff enough: its own weight presses it together by 1.5 % at the floor.
    let sand = Material::Sand { young: 2e5, poisson: 0.3, friction };
    let mut pool = Pool::new(lattice, sand, 1600.0, [WIDTH, high], false, 7.0 * WIDTH);
    pool.world.gravity = [0.0, 0.0, -9.81];
    pool.world.courant = setting.courant;
    pool.world.colliders[0] = ground(0.0, friction);
    let mut play = Play::new(gpu, &pool.world, setting.method)?;
    let fall = play.measure(0)?.mass * 9.81 * 0.5 * high;
    // Five times as long as it takes to fall.
    for _ in 0..5 {
        play.frame((2.0 * high / 9.81).sqrt())?;
    }
    let profile = pool.profile(&play.particles()?);
    let run_out = (reach(&play.particles()?) + pool.behind) / (WIDTH + pool.behind) - 1.0;
    let motion = play.measure(0)?.kinetic / fall;
    Ok(Collapse { outcome: play.finish((run_out / 3.0 - 1.0).abs()), run_out, height: profile.top() / WIDTH, motion })
}

//! M1: an elastic block that falls freely, and one that spins freely.

use physvideo::scene::Material;
use physvideo_gpu::Gpu;

use super::setup::{Lattice, Play, world};
use super::{Outcome, Problem, Setting, elastic};

const SOFT: Material = Material::Elastic { young: 1e3, poisson: 0.3 };
const GRAVITY: f64 = 9.81;

/// Free fall.
pub const FALL: Problem = Problem {
    id: "M1",
    title: "free fall, cells along a block: v = n g dt and x = g dt² n (n + 1) / 2 after n steps; the larger relative error",
    // f32 carries 6e-8 a step, two hundred steps and more.
    goal: 5e-5,
    methods: &elastic::METHODS,
    resolutions: &[4, 6, 8, 12],
    courants: &elastic::COURANTS,
    run: |gpu, setting| fall(gpu, setting, 1.0).map(|(outcome, _)| outcome),
};

/// Free rotation.
pub const SPIN: Problem = Problem {
    id: "M1-spin",
    title: "free rotation, cells along a block at 4 rad/s: change of its angular momentum in 0.2 s, C included",
    goal: 1e-5,
    methods: &elastic::METHODS,
    resolutions: &[4, 6, 8, 12],
    courants: &elastic::COURANTS,
    run: |gpu, setting| spin(gpu, setting).map(|(outcome, _)| outcome),
};

/// A block falls for about 0.13 s in equal steps with `pull` times gravity; also the number of steps.
///
/// # Errors
/// The device's refusal.
pub fn fall(gpu: &Gpu, setting: Setting, pull: f64) -> Result<(Outcome, u32), String> {
    let lattice = Lattice::of(setting.method, 0.25 / f64::from(setting.resolution));
    let cube = lattice.fill([0.25; 3], [0.5; 3], |_| true);
    let block = lattice.body(SOFT, 100.0, &cube, |_| [0.0; 3]);
    let mut w = world(vec![block], lattice.dx, [0.0, 0.0, -1.0], [1.0; 3]);
    w.gravity = [0.0, 0.0, (-GRAVITY * pull) as f32];
    w.courant = setting.courant;
    // A power of two, so that n steps fill the frame exactly.
    let step = f64::from(w.step()).log2().floor().exp2();
    w.force_dt = Some(step as f32);
    let mut play = Play::new(gpu, &w, setting.method)?;
    let before = play.center()?;
    let steps = (0.125 / step).round();
    let stats = play.frame(steps * step)?;
    let m = play.measure(0)?;
    let speed = -m.momentum[2] / m.mass / (GRAVITY * step * steps);
    let fallen = (before[2] - play.center()?[2]) / (GRAVITY * step * step * steps * (steps + 1.0) / 2.0);
    let error = (speed - 1.0).abs().max((fallen - 1.0).abs());
    Ok((play.finish(error), stats.substeps))
}

/// A block spins about z; also its momentum over its mass [m/s].
///
/// # Errors
/// The device's refusal.
pub fn spin(gpu: &Gpu, setting: Setting) -> Result<(Outcome, f64), String> {
    let lattice = Lattice::of(setting.method, 0.25 / f64::from(setting.resolution));
    let cube = lattice.fill([-0.125; 3], [0.125; 3], |_| true);
    let block = lattice.body(SOFT, 100.0, &cube, |x| [-4.0 * x[1], 4.0 * x[0], 0.0]);
    let mut w = world(vec![block], lattice.dx, [-0.5; 3], [0.5; 3]);
    w.courant = setting.courant;
    let mut play = Play::new(gpu, &w, setting.method)?;
    // The first step fills C, which carries part of the angular momentum from then on: m dx²/4 a unit of it.
    play.frame(f64::from(w.step()))?;
    let total = |play: &Play| -> Result<f64, String> {
        let own = lattice.dx * lattice.dx / 4.0;
        let each = |p: &physvideo_gpu::kernels::Particle| {
            let f = f64::from;
            f(p.m) * (f(p.x[0]) * f(p.v[1]) - f(p.x[1]) * f(p.v[0]) + own * (f(p.c1[0]) - f(p.c0[1])))
        };
        Ok(play.particles()?.iter().map(each).sum())
    };
    let before = total(&play)?;
    play.frame(0.2)?;
    let after = total(&play)?;
    let m = play.measure(0)?;
    let drift = m.momentum.iter().map(|p| p.abs()).fold(0.0, f64::max) / m.mass;
    Ok((play.finish((after / before - 1.0).abs()), drift))
}

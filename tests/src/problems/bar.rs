//! M5: a bar fixed at one end, started in its first axial mode; ω = (π/2L) sqrt(E/ρ). The wall is a mirror: the bar and
//! its reflection move as one free bar of twice the length. (A sticking plane on the grid acts 0.3 cells behind the last
//! node it holds, which alone would lengthen the period by 0.6 % at 50 cells.)

use std::f64::consts::PI;

use physvideo::scene::Material;
use physvideo_gpu::Gpu;

use super::setup::{Lattice, Play, whole_steps, world};
use super::{Outcome, Problem, Setting, elastic};

const LENGTH: f64 = 25.0;
const SPEED: f64 = 0.1;
/// Period of E = 100, ρ = 1 [s].
pub const PERIOD: f64 = 10.0;
/// Amplitude of the half's centre of mass: 0.1 (2/π) / ω [m].
const AMPLITUDE: f64 = 0.101_321_2;

/// The bar.
pub const BAR: Problem = Problem {
    id: "M5",
    title: "vibrating bar, cells along 25 m: centre of mass over 1.5 periods against 0.101321 sin ωt, rms, relative",
    // A period that is wrong by 0.1 % and a loss of 0.5 % give half a percent each.
    goal: 1e-2,
    methods: &elastic::WITH_OWN_GRID,
    resolutions: &[5, 10, 20, 40, 80],
    courants: &elastic::COURANTS,
    run: |gpu, setting| vibrate(gpu, setting, 100.0).map(|v| v.outcome),
};

/// What a bar did.
#[derive(Clone, Copy, Debug)]
pub struct Vibration {
    /// Of the motion, against that of E = 100.
    pub outcome: Outcome,
    /// Time of the second zero crossing [s].
    pub period: f64,
    /// Share of the amplitude lost from the first peak to the second.
    pub loss: f64,
}

/// A bar of Young's modulus `young`, density 1, for a period and a half.
///
/// # Errors
/// The device's refusal, or that it does not swing.
pub fn vibrate(gpu: &Gpu, setting: Setting, young: f32) -> Result<Vibration, String> {
    let lattice = Lattice::of(setting.method, LENGTH / f64::from(setting.resolution));
    let dx = lattice.dx;
    let bar = lattice.fill([-LENGTH, 0.0, 0.0], [LENGTH, 2.0 * dx, 2.0 * dx], |_| true);
    let right: Vec<usize> = (0..bar.len()).filter(|i| bar[*i][0] > 0.0).collect();
    let material = Material::Elastic { young, poisson: 0.0 };
    let body = lattice.body(material, 1.0, &bar, |x| [SPEED * (PI * x[0] / (2.0 * LENGTH)).sin(), 0.0, 0.0]);
    let margin = 4.0 * dx;
    let low = [-LENGTH - margin, -margin, -margin];
    let mut w = world(vec![body], dx, low, [LENGTH + margin, 2.0 * dx + margin, 2.0 * dx + margin]);
    w.courant = setting.courant;
    let mut play = Play::new(gpu, &w, setting.method)?;
    let center = |play: &Play| -> Result<f64, String> {
        let particles = play.particles()?;
        Ok(right.iter().map(|i| f64::from(particles[*i].x[0])).sum::<f64>() / right.len() as f64)
    };
    let rest = center(&play)?;
    let step = whole_steps(&w, SPEED, 0.2);
    let frames = (1.5 * PERIOD / step).ceil() as usize;
    let mut track = vec![0.0];
    for _ in 0..frames {
        play.frame(step)?;
        track.push(center(&play)? - rest);
    }
    let (mut off, mut own) = (0.0, 0.0);
    for (i, x) in track.iter().enumerate() {
        let exact = AMPLITUDE * (2.0 * PI / PERIOD * i as f64 * step).sin();
        off += (x - exact).powi(2);
        own += exact * exact;
    }
    let (period, loss) = swing(&track, step).ok_or("the bar does not swing")?;
    Ok(Vibration { outcome: play.finish((off / own).sqrt()), period, loss })
}

/// Time of the second zero crossing, by lines, and what the second peak lacks of the first, by parabolas.
fn swing(track: &[f64], step: f64) -> Option<(f64, f64)> {
    let last = (1..track.len() - 1).filter(|i| (track[*i] > 0.0) != (track[i + 1] > 0.0)).nth(1)?;
    let (a, b) = (track[last], track[last + 1]);
    Some((step * (last as f64 + a / (a - b)), 1.0 - peak(&track[last..])? / peak(&track[..last])?))
}

fn peak(track: &[f64]) -> Option<f64> {
    let top = (1..track.len() - 1).max_by(|i, j| track[*i].total_cmp(&track[*j]))?;
    let (a, b, c) = (track[top - 1], track[top], track[top + 1]);
    Some(b - (c - a).powi(2) / (8.0 * (a - 2.0 * b + c)))
}

//! M7: a beam clamped at one end under its own weight, in plane strain, against the inextensible elastica with a dead
//! uniform load (Bisshopp & Drucker 1945 for its form) and Timoshenko's shear.

use std::f64::consts::TAU;

use physvideo::scene::Material;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Field;
use physvideo_gpu::kernels::family::field::{UNIFORM, WIND};

use super::setup::{Lattice, Play, between, plane, world};
use super::{Outcome, Problem, Setting, elastic};

/// Ten times as long as thick.
pub const BEAM: Problem = Problem {
    id: "M7",
    title: "cantilever, L/h 10, cells of thickness: sag of the tip against the elastica with shear, load wL³/(EI) 1",
    goal: 0.04,
    methods: &elastic::METHODS,
    resolutions: &[2, 3, 4, 6],
    courants: &elastic::COURANTS,
    run: |gpu, setting| run(gpu, setting, 10.0),
};

/// Five times as long as thick: cheaper, and the shear is a twentieth of the sag.
pub const SHORT: Problem = Problem {
    id: "M7-short",
    title: "short cantilever, L/h 5, cells of thickness: sag of the tip against the elastica with shear, load wL³/(EI) 1",
    goal: 0.04,
    methods: &elastic::METHODS,
    resolutions: &[2, 4, 8, 12],
    courants: &elastic::COURANTS,
    run: |gpu, setting| run(gpu, setting, 5.0),
};

/// A beam, and what it is made of.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Length over thickness.
    pub slender: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Neo-Hookean instead of fixed-corotated.
    pub neo_hookean: bool,
}

impl Beam {
    /// Fixed-corotated, ν = 0.3.
    pub fn new(slender: f64) -> Self {
        Self { slender, poisson: 0.3, neo_hookean: false }
    }

    /// Sag of the tip over the length. Shear adds 4 E'I / (κ G A L²) to a slender beam's sag, E' = E/(1 − ν²), with
    /// κ = 5 (1 + ν) / (6 + 5 ν) for a rectangle.
    pub fn exact(&self, load: f64) -> f64 {
        let nu = self.poisson;
        let kappa = 5.0 * (1.0 + nu) / (6.0 + 5.0 * nu);
        let shear = 2.0 / (3.0 * (1.0 - nu) * kappa * self.slender.powi(2));
        elastica(load) * (1.0 + shear)
    }
}

fn run(gpu: &Gpu, setting: Setting, slender: f64) -> Result<Outcome, String> {
    let beam = Beam::new(slender);
    let (sag, outcome) = sag(gpu, setting, beam, 1.0)?;
    Ok(Outcome { error: (sag / beam.exact(1.0) - 1.0).abs(), ..outcome })
}

/// Sag of the tip of the inextensible elastica over its length, with w L³ / (E I) = `load` hanging down: θ″ = −load
/// (1 − s) cos θ, θ(0) = 0, θ′(1) = 0, by shooting.
pub fn elastica(load: f64) -> f64 {
    const STEPS: u32 = 1000;
    let h = 1.0 / f64::from(STEPS);
    // Slope and sag at the end for a curvature at the clamp; midpoint rule.
    let shoot = |curvature: f64| {
        let (mut theta, mut bend, mut sag) = (0.0f64, curvature, 0.0);
        for i in 0..STEPS {
            let s = f64::from(i) * h;
            let middle = theta + 0.5 * h * bend;
            let bend_middle = bend - 0.5 * h * load * (1.0 - s) * theta.cos();
            theta += h * bend_middle;
            bend -= h * load * (1.0 - s - 0.5 * h) * middle.cos();
            sag += h * middle.sin();
        }
        (bend, sag)
    };
    // The clamp's moment is at most that of a stiff beam, load / 2.
    let (mut low, mut high) = (0.0, 0.5 * load);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if shoot(middle).0 > 0.0 { high = middle } else { low = middle }
    }
    shoot(0.5 * (low + high)).1
}

/// Sag of a beam's tip over its length, at rest, for a load. The clamp: a sticking plane holds the nodes at x ≤ 0 and
/// acts 0.3 cells behind them (see the bar), so the beam begins there.
///
/// # Errors
/// The device's refusal.
pub fn sag(gpu: &Gpu, setting: Setting, beam: Beam, load: f64) -> Result<(f64, Outcome), String> {
    let lattice = Lattice::of(setting.method, 1.0);
    let dx = lattice.dx;
    let thick = f64::from(setting.resolution) * dx;
    let free = (beam.slender * thick).round();
    let length = free + 0.3 * dx;
    let (young, nu, density) = (1e4, beam.poisson, 1.0);
    let places = lattice.fill([-3.0 * dx, 0.0, 0.0], [free, thick, 2.0 * dx], |_| true);
    let (stiff, ratio) = (young as f32, nu as f32);
    let material = if beam.neo_hookean {
        Material::NeoHookean { young: stiff, poisson: ratio }
    } else {
        Material::Elastic { young: stiff, poisson: ratio }
    };
    let body = lattice.body(material, density, &places, |_| [0.0; 3]);
    let below = -beam.exact(load) * 1.3 * length - 6.0 * dx;
    let mut w = world(vec![body], dx, [-4.0, below, 0.0], [length + 3.0, thick + 4.0, 2.0 * dx]);
    w.courant = setting.courant;
    let stiffness = young / (1.0 - nu * nu) * thick.powi(2) / 12.0;
    let g = load * stiffness / (density * length.powi(3));
    // First bending mode. Drag of 0.8 times its critical one lets the beam settle: a period and three quarters leave
    // exp(−0.8 · 3.5 π) = 1.5e-4 of the motion.
    let rate = 3.516 / (length * length) * (stiffness / density).sqrt();
    let period = TAU / rate;
    let air = Field { kind: WIND, end: 1e9, p0: (1.6 * rate) as f32, ..Default::default() };
    let weight = Field { kind: UNIFORM, end: 1e9, a: [0.0, -g as f32, 0.0, 0.0], ..Default::default() };
    w.fields = vec![weight, air];
    w.colliders = vec![plane([0.0; 3], [1.0, 0.0, 0.0], true)];
    w.colliders.extend(between(dx, 2.0));
    let mut play = Play::new(gpu, &w, setting.method)?;
    for _ in 0..7 {
        play.frame(0.25 * period)?;
    }
    // The end face is half a spacing beyond the last column of particles: a line through the last two.
    let particles = play.particles()?;
    let sunk = |column: f64| {
        let at = free - (column + 0.5) * lattice.spacing();
        let here = places.iter().zip(&particles).filter(|(x, _)| (x[0] - at).abs() < 0.1 * lattice.spacing());
        let (sum, count) = here.fold((0.0, 0.0), |(s, n), (x, p)| (s + x[1] - f64::from(p.x[1]), n + 1.0));
        sum / count
    };
    let tip = 1.5 * sunk(0.0) - 0.5 * sunk(1.0);
    Ok((tip / length, play.finish(0.0)))
}

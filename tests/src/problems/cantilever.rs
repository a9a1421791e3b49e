//! M7: a beam clamped at one end under its own weight, against the inextensible elastica with a dead uniform load
//! (Bisshopp & Drucker 1945 for its form) and Timoshenko's shear. With ν = 0 plane strain, plane stress and a free slab
//! are one and the same: planes that hold a slab push and do not pull, and so hold the pressed half of a beam only.

use std::f64::consts::TAU;

use physvideo::scene::Material;
use physvideo::world::World;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Field;
use physvideo_gpu::kernels::family::field::{UNIFORM, WIND};

use super::setup::{BEHIND, Lattice, Play, plane, world};
use super::{Outcome, Problem, Setting, elastic};

/// Ten times as long as thick.
pub const BEAM: Problem = Problem {
    id: "M7",
    title: "cantilever, L/h 10, cells of thickness: sag of the tip against the elastica with shear, load wL³/(EI) 1",
    goal: 0.04,
    methods: &elastic::WITH_OWN_GRID,
    resolutions: &[2, 3, 4, 6],
    courants: &elastic::COURANTS,
    run: |gpu, setting| run(gpu, setting, 10.0),
};

/// Five times as long as thick: cheaper, and the shear is a twentieth of the sag.
pub const SHORT: Problem = Problem {
    id: "M7-short",
    title: "short cantilever, L/h 5, cells of thickness: sag of the tip against the elastica with shear, load wL³/(EI) 1",
    goal: 0.04,
    methods: &elastic::WITH_OWN_GRID,
    resolutions: &[2, 4, 8, 12],
    courants: &elastic::COURANTS,
    run: |gpu, setting| run(gpu, setting, 5.0),
};

/// Young's modulus [Pa]; the density is 1.
const YOUNG: f64 = 1e4;
/// Width across the bending [m].
const WIDE: f64 = 2.0;

/// A beam.
#[derive(Clone, Copy, Debug)]
pub struct Beam {
    /// Length over thickness.
    pub slender: f64,
    /// Neo-Hookean instead of fixed-corotated.
    pub neo_hookean: bool,
}

impl Beam {
    /// Fixed-corotated.
    pub fn new(slender: f64) -> Self {
        Self { slender, neo_hookean: false }
    }

    /// Sag of the tip over the length. Shear adds 4 EI / (κ G A L²) to a slender beam's sag, with G = E/2 and κ = 5/6
    /// for a rectangle.
    pub fn exact(&self, load: f64) -> f64 {
        elastica(load) * (1.0 + 0.8 / self.slender.powi(2))
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

/// A beam as wide as it is thick, some cells of 1 m, without loads.
pub fn square(beam: Beam, cells: u32) -> World {
    beam_in("updated_lagrangian", beam, cells, f64::from(cells)).1
}

/// A body on its own grid is held by its particles at x < 0, and its clamp is their face.
fn own_grid(method: &str) -> bool {
    method == "total_lagrangian"
}

/// Particles and world; the clamp: a sticking plane holds the nodes at x ≤ 0.
fn beam_in(method: &str, beam: Beam, cells: u32, wide: f64) -> (Vec<[f64; 3]>, World) {
    let lattice = Lattice::of(method, 1.0);
    let thick = f64::from(cells);
    let free = (beam.slender * thick).round();
    let places = lattice.fill([-3.0, 0.0, 0.0], [free, thick, wide], |_| true);
    let material = if beam.neo_hookean {
        Material::NeoHookean { young: YOUNG as f32, poisson: 0.0 }
    } else {
        Material::Elastic { young: YOUNG as f32, poisson: 0.0 }
    };
    let body = lattice.body(material, 1.0, &places, |_| [0.0; 3]);
    let mut w = world(vec![body], 1.0, [-4.0, -free - 6.0, -2.0], [free + 4.0, thick + 4.0, wide + 2.0]);
    if own_grid(method) {
        w.bodies[0].pinned = places.iter().map(|x| x[0] < 0.0).collect();
    } else {
        w.colliders = vec![plane([0.0; 3], [1.0, 0.0, 0.0], true)];
    }
    (places, w)
}

/// Sag of a beam's tip over its length, at rest, for a load. The plane acts 0.3 cells behind the nodes it holds (see the
/// bar), so the beam begins there.
///
/// # Errors
/// The device's refusal.
pub fn sag(gpu: &Gpu, setting: Setting, beam: Beam, load: f64) -> Result<(f64, Outcome), String> {
    let (places, mut w) = beam_in(setting.method, beam, setting.resolution, WIDE);
    let thick = f64::from(setting.resolution);
    let free = (beam.slender * thick).round();
    let length = free + if own_grid(setting.method) { 0.0 } else { BEHIND };
    w.courant = setting.courant;
    let stiffness = YOUNG * thick.powi(2) / 12.0;
    let g = load * stiffness / length.powi(3);
    // First bending mode. Drag of 0.8 times its critical one lets the beam settle: a period and three quarters leave
    // exp(−0.8 · 3.5 π) = 1.5e-4 of the motion.
    let rate = 3.516 / (length * length) * stiffness.sqrt();
    let period = TAU / rate;
    let air = Field { kind: WIND, end: 1e9, p0: (1.6 * rate) as f32, ..Default::default() };
    let weight = Field { kind: UNIFORM, end: 1e9, a: [0.0, -g as f32, 0.0, 0.0], ..Default::default() };
    w.fields = vec![weight, air];
    let mut play = Play::new(gpu, &w, setting.method)?;
    for _ in 0..7 {
        play.frame(0.25 * period)?;
    }
    // The end face is half a spacing beyond the last column of particles: a line through the last two.
    let spacing = Lattice::of(setting.method, 1.0).spacing();
    let particles = play.particles()?;
    let sunk = |column: f64| {
        let at = free - (column + 0.5) * spacing;
        let here = places.iter().zip(&particles).filter(|(x, _)| (x[0] - at).abs() < 0.1 * spacing);
        let (sum, count) = here.fold((0.0, 0.0), |(s, n), (x, p)| (s + x[1] - f64::from(p.x[1]), n + 1.0));
        sum / count
    };
    let tip = 1.5 * sunk(0.0) - 0.5 * sunk(1.0);
    Ok((tip / length, play.finish(0.0)))
}

//! M10: the return maps of von Mises plasticity, sand and snow, on single particles led along a path of stretches. Each
//! particle is alone on its part of the grid, where an affine velocity is carried exactly, and so heavy that its stress
//! does not move it: a step multiplies F by I + dt C with the C that it was given. Expected are closed forms.

use physvideo::scene::Material;
use physvideo_gpu::Gpu;

use super::setup::{Lattice, Play, world};
use super::{Outcome, Problem, Setting, elastic};

/// The problem.
pub const MAPS: Problem = Problem {
    id: "M10",
    title: "return maps of von Mises, sand and snow, steps along a path of stretches: largest error of a stress, over the largest",
    goal: 1e-5,
    methods: &["updated_lagrangian", "mls"],
    resolutions: &[1, 2, 4, 8],
    courants: &elastic::COURANTS,
    run: |gpu, setting| run(gpu, setting, 1.0),
};

const YOUNG: f64 = 1e5;
const POISSON: f64 = 0.25;
/// 2μ [Pa].
const TWICE_MU: f64 = YOUNG / (1.0 + POISSON);
/// λ [Pa].
const LAMBDA: f64 = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
/// Yield stress and how it hardens [Pa].
const YIELD: f64 = 8e3;
const HARDENING: f64 = 2e4;
/// Internal friction of the sand.
const FRICTION: f64 = 0.5;
/// Snow's limits and how fast it hardens.
const SNOW: [f64; 3] = [0.1, 0.05, 5.0];

/// A leg of a path: logarithms of the stretches it adds along x, y, z.
type Leg = [f64; 3];
/// Principal Kirchhoff stresses [Pa].
type Stress = [f64; 3];

/// A path and the stress at the end of each of its legs.
struct Path {
    material: Material,
    legs: Vec<Leg>,
    ends: Vec<Stress>,
}

fn hencky(strain: [f64; 3]) -> Stress {
    let trace: f64 = strain.iter().sum();
    strain.map(|e| TWICE_MU * e + LAMBDA * trace)
}

/// Shear beyond yield, and half of it back. Along one direction of shear from rest, with √(2/3) (σ + H α) = 2μ (‖e‖ − γ)
/// and α = √(2/3) γ, the flow is γ = (2μ ‖e‖ − √(2/3) σ) / (2μ + ⅔ H) in however many steps; back it is elastic, if
/// not by more than twice the radius.
fn von_mises(of_yield: f64) -> Path {
    let there = [0.15, -0.15, 0.0];
    let back = [-0.06, 0.06, 0.0];
    let size = 0.15 * f64::sqrt(2.0);
    let flow = (TWICE_MU * size - f64::sqrt(2.0 / 3.0) * of_yield * YIELD) / (TWICE_MU + 2.0 / 3.0 * HARDENING);
    let left = there.map(|e| e * (1.0 - flow / size));
    let after = std::array::from_fn(|i| left[i] + back[i]);
    let material = Material::Plastic {
        young: YOUNG as f32,
        poisson: POISSON as f32,
        yield_stress: YIELD as f32,
        hardening: HARDENING as f32,
    };
    Path { material, legs: vec![there, back], ends: vec![hencky(left), hencky(after)] }
}

/// Pressed together, sheared beyond what friction holds, pulled apart, pressed halfway back, pressed again. Shear at one
/// volume leaves ‖dev ε‖ = −α (3λ + 2μ)/(2μ) tr ε; what has expanded by δ beyond no stress is remembered, carries
/// nothing, and carries again after δ.
fn sand(of_friction: f64) -> Path {
    let sin = FRICTION / FRICTION.hypot(1.0);
    let alpha = of_friction * f64::sqrt(2.0 / 3.0) * 2.0 * sin / (3.0 - sin);
    let (press, shear, pull) = (-0.04, 0.2, 0.08);
    let kept = alpha * (3.0 * LAMBDA + TWICE_MU) / TWICE_MU * 3.0 * -press / f64::sqrt(2.0);
    let held = [press + kept, press - kept, press];
    // Straight out of the cone: all of the shear is gone by the time the trace is 0, and δ = 3 (pull + press).
    let again = hencky([-0.016; 3]);
    Path {
        material: Material::Sand { young: YOUNG as f32, poisson: POISSON as f32, friction: FRICTION as f32 },
        legs: vec![
            [press; 3],
            [shear, -shear, 0.0],
            [pull; 3],
            [-0.5 * (pull + press); 3],
            [-0.5 * (pull + press) - 0.016; 3],
        ],
        ends: vec![hencky([press; 3]), hencky(held), [0.0; 3], [0.0; 3], again],
    }
}

/// Pressed along x beyond its limit. What is left is 1 − θc, the plastic volume J_p is the rest, and both moduli grow as
/// exp(ξ (1 − J_p)). Then pulled until it breaks: 1 + θs is left, and J_p has grown by what is beyond.
fn snow(of_limit: f64) -> Path {
    let [limit, most, harder] = SNOW;
    let limit = of_limit * limit;
    let stress = |s: f64, packed: f64| {
        let times = (harder * (1.0 - packed)).exp();
        let volume = LAMBDA * s * (s - 1.0);
        [TWICE_MU * (s - 1.0) * s + volume, volume, volume].map(|t| times * t)
    };
    let (press, pull) = (-0.25, 0.3);
    let packed = f64::exp(press) / (1.0 - limit);
    let broken = f64::exp(press + pull) / (1.0 + most);
    Path {
        material: Material::Snow {
            young: YOUNG as f32,
            poisson: POISSON as f32,
            critical_compression: SNOW[0] as f32,
            critical_stretch: SNOW[1] as f32,
            hardening: SNOW[2] as f32,
        },
        legs: vec![[press, 0.0, 0.0], [pull, 0.0, 0.0]],
        ends: vec![stress(1.0 - limit, packed), stress(1.0 + most, broken)],
    }
}

fn run(gpu: &Gpu, setting: Setting, of: f64) -> Result<Outcome, String> {
    let mut all = Outcome::default();
    for path in [von_mises(of), sand(of), snow(of)] {
        let one = follow(gpu, setting, &path)?;
        all = Outcome {
            error: all.error.max(one.error),
            wall_s: all.wall_s + one.wall_s,
            simulated_s: all.simulated_s + one.simulated_s,
            substeps: all.substeps + one.substeps,
            clamps: all.clamps + one.clamps,
            particles: all.particles + one.particles,
        };
    }
    Ok(all)
}

/// The error of each material's map against closed forms whose yield stress, friction or limit is `of` of the material's:
/// von Mises, sand, snow.
///
/// # Errors
/// The device's refusal.
pub fn errors(gpu: &Gpu, setting: Setting, of: f64) -> Result<[f64; 3], String> {
    let mut out = [0.0; 3];
    for (error, path) in out.iter_mut().zip([von_mises(of), sand(of), snow(of)]) {
        *error = follow(gpu, setting, &path)?.error;
    }
    Ok(out)
}

/// Leads 27 particles, each elsewhere in its cell, along a path: every leg in `resolution` steps.
fn follow(gpu: &Gpu, setting: Setting, path: &Path) -> Result<Outcome, String> {
    let places: Vec<[f64; 3]> =
        (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|c| f64::from(c) * 8.0 + 0.05 + 0.31 * f64::from(c))).collect();
    // Stress over density times dt² is what a step would be moved by: nothing.
    let body = Lattice::of_eight(1.0).body(path.material, 1e12, &places, |_| [0.0; 3]);
    let mut w = world(vec![body], 1.0, [-4.0; 3], [24.0; 3]);
    let dt = setting.courant * 1e-2;
    w.force_dt = Some(dt);
    let mut play = Play::new(gpu, &w, setting.method)?;
    let start = play.particles()?;
    let volume = f64::from(w.bodies[0].particle_volume);
    let largest = path.ends.iter().flatten().fold(0.0, |most: f64, s| most.max(s.abs()));
    let mut error = 0.0;
    for (leg, end) in path.legs.iter().zip(&path.ends) {
        for _ in 0..setting.resolution {
            // Each step by its share of the leg's logarithms.
            let rate = leg.map(|e| (f64::exp_m1(e / f64::from(setting.resolution)) / f64::from(dt)) as f32);
            let (mut particles, deformations) = (play.particles()?, play.deformations()?);
            for (p, s) in particles.iter_mut().zip(&start) {
                (p.x, p.v) = (s.x, [0.0; 3]);
                (p.c0[0], p.c1[1], p.c2[2]) = (rate[0], rate[1], rate[2]);
                (p.c0[1], p.c0[2], p.c1[0], p.c1[2], p.c2[0], p.c2[1]) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
            }
            play.put(&particles, &deformations)?;
            play.frame(f64::from(dt))?;
        }
        for p in play.particles()? {
            let got = [p.c0[3], p.c1[3], p.c2[3]].map(|s| f64::from(s) / volume);
            let off = got
                .iter()
                .zip(end)
                .map(|(g, w)| (g - w).abs())
                .chain(p.s[..3].iter().map(|s| f64::from(*s).abs() / volume));
            error = off.fold(error, f64::max);
        }
    }
    Ok(play.finish(error / largest))
}

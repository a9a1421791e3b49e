//! Problems with a known answer, run with any method, resolution and step: small as tests, swept by `physvideo-bench wp`.
//! A problem knows the solvers' public interface, and neither tests nor diagrams.

pub mod sph;

use physvideo_gpu::Gpu;

pub mod bar;
pub mod cantilever;
pub mod column;
pub mod deposit;
pub mod discs;
pub mod elastic;
pub mod liquid;
pub mod manufactured;
pub mod motion;
pub mod sand;
pub mod settle;
pub mod setup;
pub mod viscous;
pub mod yielding;

/// How a problem is run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// One of the problem's methods, for example "updated_lagrangian", "total_lagrangian", "wcsph".
    pub method: &'static str,
    /// Cells or particles along the length that the problem names.
    pub resolution: u32,
    /// Share of the stable step: a Courant number.
    pub courant: f32,
}

/// What came of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Outcome {
    /// Error in the problem's own measure, relative: 0.01 is 1 %.
    pub error: f64,
    /// Wall time of the simulation, first compilation left out [s].
    pub wall_s: f64,
    /// Simulated time [s].
    pub simulated_s: f64,
    /// Steps taken.
    pub substeps: u64,
    /// Limits hit: clamps, rejected attempts, particles taken out.
    pub clamps: u64,
    /// Particles.
    pub particles: u64,
}

/// A problem.
#[derive(Debug)]
pub struct Problem {
    /// Id of the suite, for example "M5".
    pub id: &'static str,
    /// What is solved and how the error is measured, one line.
    pub title: &'static str,
    /// Error that the method's defaults should reach at the finest resolution.
    pub goal: f64,
    /// Methods that can run it.
    pub methods: &'static [&'static str],
    /// At least four, ascending.
    pub resolutions: &'static [u32],
    /// At least three, ascending.
    pub courants: &'static [f32],
    /// Runs it; an `Err` says why there is no result.
    pub run: fn(&Gpu, Setting) -> Result<Outcome, String>,
}

/// Every problem.
pub fn all() -> Vec<&'static Problem> {
    static GROUPS: [&[Problem]; 3] =
        [&elastic::PROBLEMS, &sph::PROBLEMS, &[sand::COLUMN, yielding::MAPS, liquid::TANK, liquid::DAM]];
    GROUPS.iter().flat_map(|g| g.iter()).collect()
}

/// Observed order of errors at resolutions: minus the slope of the line of least squares through their logarithms.
pub fn order(errors: &[(f64, f64)]) -> f64 {
    let points: Vec<(f64, f64)> = errors.iter().map(|(n, e)| (n.ln(), e.ln())).collect();
    let n = points.len() as f64;
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / n;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let (up, along) =
        points.iter().fold((0.0, 0.0), |(up, along), p| (up + (p.0 - x) * (p.1 - y), along + (p.0 - x).powi(2)));
    -up / along
}

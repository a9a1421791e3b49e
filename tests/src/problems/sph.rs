//! Problems of liquids: S1 a tank at rest, S2 a breaking dam, S4 Poiseuille flow from rest.

use std::time::Instant;

use physvideo::fluid::Fluid;
use physvideo::scene::Pressure;
use physvideo::stages::solver::FrameStats;
use physvideo::stages::sph::Sph;
use physvideo_gpu::kernels::{Field, Particle, family};
use physvideo_gpu::{Gpu, GpuError};

use super::{Outcome, Problem, Setting};
use crate::liquid::{lattice, liquid, plane, room, world};

/// The problems.
pub const PROBLEMS: [Problem; 3] = [
    Problem {
        id: "S1",
        title: "hydrostatic tank: pressure of the lowest layer against ρ g (H − z), relative",
        goal: 1e-3,
        methods: &["wcsph", "dfsph"],
        resolutions: &[5, 8, 10, 16],
        courants: &[0.375, 0.75, 1.0],
        run: run_tank,
    },
    Problem {
        id: "S2",
        title: "dam break, n² = 2 (Martin & Moyce 1952): mean distance of the front from the band of experiments, relative",
        goal: 0.05,
        methods: &["wcsph", "dfsph"],
        resolutions: &[6, 8, 12, 20],
        courants: &[0.375, 0.75, 1.0],
        run: run_dam,
    },
    Problem {
        id: "S4",
        title: "Poiseuille start-up: speed in the middle against the series, largest error over u_max",
        goal: 5e-3,
        methods: &["wcsph", "dfsph"],
        resolutions: &[6, 8, 12, 16],
        courants: &[0.375, 0.75, 1.0],
        run: run_channel,
    },
];

fn method(setting: Setting) -> Result<Pressure, String> {
    match setting.method {
        "wcsph" => Ok(Pressure::Wcsph),
        "dfsph" => Ok(Pressure::Dfsph),
        other => Err(format!("no method `{other}`")),
    }
}

fn limits_hit(all: &[FrameStats]) -> u64 {
    all.iter().map(|s| u64::from(s.clamped_velocity + s.clamped_volume + s.quarantined + s.rejected)).sum()
}

/// Water of 0.13 m depth that drag brings to rest.
#[derive(Clone, Copy, Debug)]
pub struct Tank {
    /// Layers of particles.
    pub layers: u32,
    /// Courant number of the scene.
    pub courant: f32,
    /// Density of the water [kg/m³]; the answer is that of 1000.
    pub density: f32,
    /// Method and tolerances; the particle size follows from the layers.
    pub fluid: Fluid,
}

impl Default for Tank {
    fn default() -> Self {
        Self { layers: 10, courant: 0.75, density: 1000.0, fluid: Fluid::default() }
    }
}

/// What came of it.
#[derive(Clone, Debug)]
pub struct Rest {
    /// Relative error of the mean pressure of the lowest layer.
    pub base: f64,
    /// Largest s − 1.
    pub densest: f64,
    /// Its frames.
    pub frames: Vec<FrameStats>,
    /// Wall time after the first frame [s].
    pub wall_s: f64,
    /// Particles.
    pub particles: usize,
}

/// Depth of the water [m].
const DEPTH: f64 = 0.13;

/// Runs a tank to rest: 0.6 s under a drag of 40/s.
///
/// # Errors
/// The device's refusal.
pub fn tank(gpu: &Gpu, t: &Tank) -> Result<Rest, GpuError> {
    let h = DEPTH / f64::from(t.layers);
    let side = 6.0 * h;
    let body = liquid(t.density, 0.0, h, lattice(h, [0.0; 3], [side, side, DEPTH]));
    let base = body.positions.iter().filter(|x| f64::from(x[2]) < h).count();
    let mut w = world(t.fluid.pressure, h, vec![body], [-0.1; 3], [0.3; 3]);
    w.fluid = Fluid { particle_size: h as f32, ..t.fluid };
    w.courant = t.courant;
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![room([0.0; 3], [side, side, 1.0])];
    w.fields = vec![Field { kind: family::field::WIND, end: 1e9, p0: 40.0, ..Default::default() }];
    let mut sph = Sph::new(gpu, &w)?;
    let mut frames = vec![sph.frame(0.1)?];
    let since = Instant::now();
    for _ in 0..5 {
        frames.push(sph.frame(0.1)?);
    }
    let wall_s = since.elapsed().as_secs_f64();
    let particles: Vec<Particle> = gpu.read(sph.particles)?;
    // The lattice is filled from below, and its layers stay in order.
    let pressure = particles[..base].iter().map(|p| f64::from(p.s[1])).sum::<f64>() / base as f64;
    let want = 1000.0 * 9.81 * (DEPTH - 0.5 * h);
    Ok(Rest {
        base: (pressure / want - 1.0).abs(),
        densest: particles.iter().map(|p| f64::from(p.s[0]) - 1.0).fold(0.0, f64::max),
        frames,
        wall_s,
        particles: particles.len(),
    })
}

fn run_tank(gpu: &Gpu, setting: Setting) -> Result<Outcome, String> {
    let fluid = Fluid { pressure: method(setting)?, ..Default::default() };
    let t = Tank { layers: setting.resolution, courant: setting.courant, fluid, ..Default::default() };
    let rest = tank(gpu, &t).map_err(|e| e.to_string())?;
    Ok(Outcome {
        error: rest.base,
        wall_s: rest.wall_s,
        simulated_s: 0.5,
        substeps: rest.frames[1..].iter().map(|s| u64::from(s.substeps)).sum(),
        clamps: limits_hit(&rest.frames),
        particles: rest.particles as u64,
    })
}

/// Front Z = z/a at T = t sqrt(2g/a) of a column a wide and 2a high: least and largest of Martin & Moyce's two sets as
/// Koshizuka & Oka and Ocellaris have them.
pub const FRONT: [(f64, f64, f64); 8] = [
    (0.85, 1.226, 1.305),
    (1.2, 1.436, 1.552),
    (1.5, 1.747, 1.855),
    (2.0, 2.296, 2.354),
    (2.55, 2.837, 3.105),
    (3.0, 3.466, 3.790),
    (3.6, 4.434, 4.531),
    (4.0, 4.904, 5.115),
];

/// The front of a breaking dam at the times of [`FRONT`], with `across` particles in the column's width.
///
/// # Errors
/// The device's refusal.
pub fn dam(
    gpu: &Gpu,
    across: u32,
    pressure: Pressure,
    courant: f32,
    gravity: f32,
) -> Result<(Vec<f64>, Rest), GpuError> {
    let a = 0.05715; // 2.25 in
    let h = a / f64::from(across);
    let depth = 4.0 * h;
    let body = liquid(1000.0, 1e-6, h, lattice(h, [0.0; 3], [a, depth, 2.0 * a]));
    let mut w = world(pressure, h, vec![body], [-0.02; 3], [7.0 * a, depth + 0.02, 3.0 * a]);
    w.courant = courant;
    w.gravity = [0.0, 0.0, -gravity];
    w.colliders = vec![room([0.0; 3], [6.5 * a, depth, 4.0 * a])];
    let unit = (a / (2.0 * 9.81)).sqrt();
    let mut sph = Sph::new(gpu, &w)?;
    let (mut fronts, mut frames, mut wall_s, mut before) = (Vec::new(), Vec::new(), 0.0, 0.0);
    for (time, _, _) in FRONT {
        let since = Instant::now();
        frames.push(sph.frame(((time - before) * unit) as f32)?);
        if before > 0.0 {
            wall_s += since.elapsed().as_secs_f64();
        }
        before = time;
        // The front's edge is half a spacing before its particles; single drops that fly ahead are not the front.
        let mut x: Vec<f64> = gpu.read(sph.particles)?.iter().map(|p| f64::from(p.x[0])).collect();
        x.sort_by(f64::total_cmp);
        fronts.push((x[x.len() - 1 - x.len() / 500] + 0.5 * h) / a);
    }
    let particles = gpu.read(sph.particles)?;
    let densest = particles.iter().map(|p| f64::from(p.s[0]) - 1.0).fold(0.0, f64::max);
    Ok((fronts, Rest { base: 0.0, densest, frames, wall_s, particles: particles.len() }))
}

/// Mean distance of a front from the band, and the largest, relative.
pub fn off_the_band(front: &[f64]) -> (f64, f64) {
    let off: Vec<f64> = FRONT
        .iter()
        .zip(front)
        .map(|((_, low, high), z)| (low - z).max(z - high).max(0.0) / (0.5 * (low + high)))
        .collect();
    (off.iter().sum::<f64>() / off.len() as f64, off.iter().copied().fold(0.0, f64::max))
}

fn run_dam(gpu: &Gpu, setting: Setting) -> Result<Outcome, String> {
    let (front, run) =
        dam(gpu, setting.resolution, method(setting)?, setting.courant, 9.81).map_err(|e| e.to_string())?;
    let unit = (0.05715f64 / (2.0 * 9.81)).sqrt();
    Ok(Outcome {
        error: off_the_band(&front).0,
        wall_s: run.wall_s,
        simulated_s: (4.0 - 0.85) * unit,
        substeps: run.frames[1..].iter().map(|s| u64::from(s.substeps)).sum(),
        clamps: limits_hit(&run.frames),
        particles: run.particles as u64,
    })
}

/// u/u_max in the middle of a channel at νt/L²: 1 − Σ 32 (−1)^k/((2k + 1)π)³ exp(−((2k + 1)π)² νt/L²).
pub fn poiseuille(time: f64) -> f64 {
    let mode = |k: i32| {
        let n = f64::from(2 * k + 1) * std::f64::consts::PI;
        32.0 * f64::from(1 - 2 * (k % 2)) / n.powi(3) * (-n * n * time).exp()
    };
    1.0 - (0..40).map(mode).sum::<f64>()
}

/// Times νt/L² at which the flow is looked at.
pub const TIMES: [f64; 5] = [0.02, 0.05, 0.1, 0.2, 0.5];

/// Speeds over u_max in the middle of a channel of `across` particles between plates that stick or not, driven from
/// rest. Whatever moves moves by less than a tenth of a spacing: the block keeps its lattice, and its free ends are as
/// good as a period, since Morris's viscosity takes nothing from a free face.
///
/// # Errors
/// The device's refusal.
pub fn channel(
    gpu: &Gpu,
    across: u32,
    pressure: Pressure,
    courant: f32,
    sticky: bool,
) -> Result<(Vec<f64>, Rest), GpuError> {
    let (gap, viscosity) = (0.1, 5e-3);
    let h = gap / f64::from(across);
    let most = 0.1 * h * viscosity / (0.5 * gap * gap);
    let body = liquid(1000.0, viscosity as f32, h, lattice(h, [0.0; 3], [4.0 * h, 4.0 * h, gap]));
    let mut w = world(pressure, h, vec![body], [-0.2; 3], [0.3; 3]);
    // The viscous limit stands alone here, where nothing is fast: the Courant number scales it.
    w.force_dt = Some((f64::from(courant) / 0.75 * 0.125 * h * h / viscosity).min(0.25 * h / 18.8) as f32);
    w.gravity = [(8.0 * viscosity * most / (gap * gap)) as f32, 0.0, 0.0];
    w.colliders = vec![plane([0.0; 3], [0.0, 0.0, 1.0], sticky), plane([0.0, 0.0, gap], [0.0, 0.0, -1.0], sticky)];
    let mut sph = Sph::new(gpu, &w)?;
    let (mut speeds, mut frames, mut wall_s, mut before) = (Vec::new(), Vec::new(), 0.0, 0.0);
    for time in TIMES {
        let since = Instant::now();
        frames.push(sph.frame(((time - before) * gap * gap / viscosity) as f32)?);
        wall_s += if before > 0.0 { since.elapsed().as_secs_f64() } else { 0.0 };
        before = time;
        let all = gpu.read(sph.particles)?;
        let mut middle: Vec<f64> = Vec::new();
        for p in &all {
            // The two layers beside the middle stand h/2 from it: there the steady profile is lower by (h/L)².
            if (f64::from(p.x[2]) - 0.5 * gap).abs() < 0.6 * h {
                middle.push(f64::from(p.v[0]) / most);
            }
        }
        speeds.push(middle.iter().sum::<f64>() / middle.len() as f64);
    }
    let densest = gpu.read(sph.particles)?.iter().map(|p| f64::from(p.s[0]) - 1.0).fold(0.0, f64::max);
    Ok((speeds, Rest { base: 0.0, densest, frames, wall_s, particles: (16 * across) as usize }))
}

/// Largest error of speeds over u_max, against the series at ± half a spacing from the middle.
pub fn off_the_series(speeds: &[f64], across: u32) -> f64 {
    let lower = f64::from(across).powi(-2);
    TIMES.iter().zip(speeds).map(|(t, u)| (u + lower * poiseuille(*t) - poiseuille(*t)).abs()).fold(0.0, f64::max)
}

fn run_channel(gpu: &Gpu, setting: Setting) -> Result<Outcome, String> {
    let n = setting.resolution;
    let (speeds, run) = channel(gpu, n, method(setting)?, setting.courant, true).map_err(|e| e.to_string())?;
    Ok(Outcome {
        error: off_the_series(&speeds, n),
        wall_s: run.wall_s,
        simulated_s: 0.96,
        substeps: run.frames[1..].iter().map(|s| u64::from(s.substeps)).sum(),
        clamps: limits_hit(&run.frames),
        particles: run.particles as u64,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_series_is_that_of_the_tables() {
        for (time, want) in TIMES.iter().zip([0.1592, 0.3704, 0.6154, 0.8566, 0.9926]) {
            assert!((poiseuille(*time) - want).abs() < 1e-4, "{time}");
        }
    }
}

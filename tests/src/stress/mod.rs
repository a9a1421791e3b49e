//! Stress: cases that must not explode. Each is run twice with any solver; what comes of it is a number everywhere, has
//! an energy within a stated bound, the same bits both times, and every limit counted, or it is an error that names
//! where. Knows neither tests nor tables.

mod injected;
mod place;
mod speed;
pub mod step;

use physvideo::scene::Material;
use physvideo::stages::mpm::QUARANTINED;
use physvideo::stages::solver::{Fastest, FrameStats};
use physvideo::world::World;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::{Deformation, Particle};

use crate::problems::setup::{say, solver};

/// The solvers; each material a solver takes is tried where a case says so.
pub const METHODS: [&str; 1] = ["updated_lagrangian"];

/// What a case does to one material.
pub struct Setup {
    /// Start.
    pub world: World,
    /// Mistakes written into the particles of the start.
    pub spoil: fn(&mut [Particle], &mut [Deformation]),
    /// Frames.
    pub frames: u32,
    /// Length of each [s].
    pub length: f64,
    /// Largest energy that may be seen.
    pub bound: Bound,
}

/// Largest energy that may be seen.
#[derive(Clone, Copy, Debug)]
pub enum Bound {
    /// This many times what there was at the start, the fall to the lowest place of the domain included, and this much
    /// besides [J].
    Energy(f64, f64),
    /// Kinetic energy of everything at the speed limit, 0.9 cells a step, the shortest step that was taken. For steps
    /// that are forced beyond their limit: nothing else holds them.
    SpeedLimit,
}

/// What comes of a case.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// No limit was hit.
    Clean,
    /// Limits were hit and counted.
    Counted,
    /// Frames were taken back and repeated with shorter steps.
    TakenBack,
    /// The run cannot go on; the solver says which particle is to blame.
    Refused,
}

impl Verdict {
    /// Word in a table.
    pub fn word(self) -> &'static str {
        match self {
            Self::Clean => "clean",
            Self::Counted => "limits counted",
            Self::TakenBack => "frame taken back",
            Self::Refused => "honest error",
        }
    }
}

/// A case.
pub struct Case {
    /// Its name, for example "impact at 50 m/s".
    pub name: &'static str,
    /// Materials it is run with.
    pub materials: &'static [&'static str],
    /// Too large for a test.
    pub large: bool,
    /// Two runs have the same bits. Not where thousands of particles fall into one row of cells: the software driver ends
    /// a lane's loops after 65,535 turns, before so many are in order.
    pub repeats: bool,
    /// What may come of it.
    pub expect: &'static [Verdict],
    /// Builds it for a material.
    pub setup: fn(Material) -> Setup,
}

/// A line of the table.
#[derive(Clone, Debug)]
pub struct Row {
    /// The case.
    pub case: &'static str,
    /// Material.
    pub material: &'static str,
    /// Solver.
    pub method: &'static str,
    /// What came of it.
    pub verdict: Verdict,
    /// Substeps, those taken back included.
    pub substeps: u64,
    /// Clamped nodes, stretches, volumes; particles taken out; frames taken back; frames with a gain of energy.
    pub counts: [u64; 6],
    /// Kinetic, elastic and potential energy at the end less those before anything was spoilt, over what there was at hand.
    pub drift: f64,
    /// Largest energy over its bound.
    pub of_bound: f64,
    /// What the solver says where it gives up.
    pub error: Option<String>,
}

/// Every case.
pub fn all() -> Vec<&'static Case> {
    static GROUPS: [&[Case]; 4] = [&step::CASES, &speed::CASES, &place::CASES, &injected::CASES];
    GROUPS.iter().flat_map(|g| g.iter()).collect()
}

/// What all of a case's runs must agree in.
#[derive(PartialEq)]
struct End {
    particles: Vec<u8>,
    deformations: Vec<u8>,
    stats: Vec<FrameStats>,
}

impl End {
    /// Where two differ, in words.
    fn differs(&self, other: &Self) -> String {
        let at = |a: &[u8], b: &[u8]| a.iter().zip(b).position(|(a, b)| a != b);
        let frame = self.stats.iter().zip(&other.stats).position(|(a, b)| a != b);
        let (particle, deformation) =
            (at(&self.particles, &other.particles), at(&self.deformations, &other.deformations));
        format!(
            "frame {frame:?}, byte {particle:?} of the particles ({} a particle), {deformation:?} of the deformations ({})",
            size_of::<Particle>(),
            size_of::<Deformation>()
        )
    }
}

/// Runs a case twice.
///
/// # Errors
/// What is wrong with what came of it, or the device's refusal.
pub fn run(gpu: &Gpu, case: &Case, material: &'static str, method: &'static str) -> Result<Row, String> {
    let wrong = |what: String| Err(format!("{}, {material}, {method}: {what}", case.name));
    let (row, first) = match once(gpu, case, material, method) {
        Ok(done) => done,
        Err(e) => return wrong(e),
    };
    if case.repeats {
        let (again, second) = once(gpu, case, material, method)?;
        if second != first {
            return wrong(format!("two runs differ: {}; {row:?} and {again:?}", first.differs(&second)));
        }
    }
    if !case.expect.contains(&row.verdict) {
        return wrong(format!("{:?} is none of {:?}: {row:?}", row.verdict, case.expect));
    }
    // A NaN is not within anything.
    if row.of_bound <= 1.0 {
        Ok(row)
    } else {
        wrong(format!("{} of the largest energy it may have: {row:?}", row.of_bound))
    }
}

fn once(gpu: &Gpu, case: &Case, material: &'static str, method: &'static str) -> Result<(Row, End), String> {
    let Setup { world, spoil, frames, length, bound } = (case.setup)(material_of(material));
    let mut solver = solver(gpu, &world, method)?;
    let bodies = world.bodies.len();
    let sums = |solver: &dyn physvideo::stages::solver::Solver| -> Result<[f64; 4], String> {
        let mut out = [0.0; 4];
        for body in 0..bodies {
            let m = solver.measure(body).map_err(say)?;
            out = std::array::from_fn(|i| out[i] + [m.kinetic, m.energy(), m.potential, m.mass][i]);
        }
        Ok(out)
    };
    let begun = sums(&*solver)?;
    // What it could turn into motion: all there is above the lowest place it may fall to.
    let at_hand = begun[1] + begun[2] + f64::from(world.gravity[2] * world.domain.0[2]) * begun[3];
    let mut particles = gpu.read(solver.particles()).map_err(say)?;
    let mut deformations = gpu.read(solver.deformations()).map_err(say)?;
    spoil(&mut particles, &mut deformations);
    gpu.write(solver.particles(), 0, &particles).map_err(say)?;
    gpu.write(solver.deformations(), 0, &deformations).map_err(say)?;
    let (mut most, mut stats, mut dt) = (begun, Vec::new(), f32::MAX);
    let mut end = begun;
    for _ in 0..frames {
        let s = solver.frame(length as f32).map_err(say)?;
        end = sums(&*solver)?;
        most = std::array::from_fn(|i| if end[i] <= most[i] { most[i] } else { end[i] });
        dt = if s.dt.0 > 0.0 { dt.min(s.dt.0) } else { dt };
        stats.push(s);
        if s.stalled.is_some() {
            break;
        }
    }
    let (particles, deformations) =
        (gpu.read(solver.particles()).map_err(say)?, gpu.read(solver.deformations()).map_err(say)?);
    drop(solver);
    gpu.free_arena("run");
    gpu.free_arena("grid");
    let error = stats.iter().find_map(|s| s.stalled).map(|f| {
        let Fastest { particle, speed, stretch, volume, .. } = f;
        format!(
            "mpm/clock, mpm/particles, particle {particle}: {speed:e} m/s, stretched to {stretch:e}, volume {volume:e}"
        )
    });
    if error.is_none() {
        for (i, (p, d)) in particles.iter().zip(&deformations).enumerate() {
            let numbers = [p.x, p.v].concat();
            let state = [&p.c0[..], &p.c1, &p.c2, &p.s, &d.f0, &d.f1, &d.f2].concat();
            if p.tag & QUARANTINED == 0 && !numbers.iter().chain(&state).all(|c| c.is_finite()) {
                return Err(format!("particle {i} is not finite and was not taken out: {p:?} {d:?}"));
            }
        }
    }
    let counts = stats.iter().fold([0; 6], |sum, s| {
        let more = [s.clamped_velocity, s.clamped_strain, s.clamped_volume, s.quarantined, s.rejected, s.gained]
            .map(u64::from);
        std::array::from_fn(|i| sum[i] + more[i])
    });
    let verdict = match counts {
        _ if error.is_some() => Verdict::Refused,
        [0, 0, 0, 0, 0, 0] => Verdict::Clean,
        [.., 0, _] => Verdict::Counted,
        _ => Verdict::TakenBack,
    };
    let of_bound = match bound {
        _ if error.is_some() || begun[3] == 0.0 => 0.0,
        Bound::Energy(times, besides) => most[1] / (times * at_hand + besides),
        Bound::SpeedLimit => most[0] / (0.5 * begun[3] * f64::from(0.9 * world.dx / dt).powi(2)),
    };
    let scale = match bound {
        Bound::Energy(_, besides) => at_hand.max(besides),
        Bound::SpeedLimit => at_hand,
    };
    let drift = (end[1] + end[2] - begun[1] - begun[2]) / scale;
    let row = Row {
        case: case.name,
        material,
        method,
        verdict,
        substeps: stats.iter().map(|s| u64::from(s.substeps)).sum(),
        counts,
        drift: if begun[3] == 0.0 || error.is_some() { 0.0 } else { drift },
        of_bound,
        error,
    };
    let end = End {
        particles: bytemuck::cast_slice(&particles).to_vec(),
        deformations: bytemuck::cast_slice(&deformations).to_vec(),
        stats,
    };
    Ok((row, end))
}

/// Every material.
pub const MATERIALS: [&str; 7] = ["elastic", "neo_hookean", "plastic", "snow", "foam", "sand", "liquid"];

/// A material by its name, as soft as jelly or as a grid's liquid, so that a body of a few cells takes few steps.
pub fn material_of(name: &str) -> Material {
    let (young, poisson) = (8e4, 0.32);
    match name {
        "neo_hookean" => Material::NeoHookean { young, poisson },
        "plastic" => Material::Plastic { young, poisson, yield_stress: 2e3, hardening: 0.0 },
        "snow" => Material::Snow {
            young: 1.4e5,
            poisson: 0.2,
            critical_compression: 0.025,
            critical_stretch: 0.0075,
            hardening: 10.0,
        },
        "foam" => Material::Foam { young, poisson },
        "sand" => Material::Sand { young: 1e5, poisson: 0.3, friction: 0.6 },
        "liquid" => Material::Liquid { bulk: 5e4, exponent: 7.0, viscosity: 0.0 },
        _ => Material::Elastic { young, poisson },
    }
}

/// The material `times` as stiff.
pub fn stiffer(material: Material, times: f32) -> Material {
    let mut material = material;
    match &mut material {
        Material::Elastic { young, .. }
        | Material::NeoHookean { young, .. }
        | Material::Plastic { young, .. }
        | Material::Snow { young, .. }
        | Material::Foam { young, .. }
        | Material::Sand { young, .. } => *young *= times,
        Material::Liquid { bulk, .. } => *bulk *= times,
        Material::Sph { .. } => {} // stiff by its solver, not by the scene
    }
    material
}

//! Stress: cases that must not explode. Each is run twice with any solver; what comes of it is a number everywhere, has
//! an energy within a stated bound, the same bits both times, and every limit counted, or it is an error that names
//! where. Knows neither tests nor tables.

mod injected;
mod own_grid;
mod place;
mod run;
mod speed;
pub mod step;

use physvideo::scene::Material;
use physvideo::world::World;
use physvideo_gpu::kernels::{Deformation, Particle};

pub use self::run::run;

/// MPM alone: cases about what it keeps in particles.
pub const MPM: &[&str] = &["updated_lagrangian"];
/// Elastic bodies on the shared grid and on grids of their own.
pub const ELASTIC: &[&str] = &["updated_lagrangian", "total_lagrangian"];
/// All that keep velocities in particles.
pub const PARTICLES: &[&str] = &["updated_lagrangian", "wcsph", "dfsph"];
/// SPH.
pub const LIQUIDS: &[&str] = &["wcsph", "dfsph"];
/// Every solver.
pub const EVERY: &[&str] = &["updated_lagrangian", "total_lagrangian", "wcsph", "dfsph"];

/// Displacement [m] and velocity [m/s] of a node by its place [m].
pub type Nodes = fn([f64; 3]) -> ([f64; 3], [f64; 3]);

/// What a case does to one material.
pub struct Setup {
    /// Start.
    pub world: World,
    /// Mistakes written into the particles of the start.
    pub spoil: fn(&mut [Particle], &mut [Deformation]),
    /// How the nodes of bodies on grids of their own start.
    pub nodes: Option<Nodes>,
    /// Steps are forced to so many of what the engine would take at the start.
    pub forced: Option<f64>,
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
    /// Solvers it is run by.
    pub solvers: &'static [&'static str],
    /// Materials it is run with by MPM; of these bodies on grids of their own take the elastic ones, and SPH has its own.
    pub materials: &'static [&'static str],
    /// Too large for a test.
    pub large: bool,
    /// Two runs have the same bits. Not where thousands of particles fall into one row of cells: the software driver ends
    /// a lane's loops after 65,535 turns, before so many are in order.
    pub repeats: bool,
    /// What may come of it by MPM.
    pub expect: &'static [Verdict],
    /// What may come of it on grids of their own, or by SPH.
    pub elsewhere: &'static [Verdict],
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
    /// Particles of a liquid found in obstacles at the end of a frame, at the most.
    pub sunk: u32,
    /// What the solver says where it gives up.
    pub error: Option<String>,
}

/// Every case.
pub fn all() -> Vec<&'static Case> {
    static GROUPS: [&[Case]; 5] = [&step::CASES, &speed::CASES, &place::CASES, &injected::CASES, &own_grid::CASES];
    GROUPS.iter().flat_map(|g| g.iter()).collect()
}

impl Case {
    /// Materials that `method` takes.
    pub fn materials_of(&self, method: &str) -> Vec<&'static str> {
        match method {
            "wcsph" | "dfsph" => vec!["sph"],
            "total_lagrangian" => {
                self.materials.iter().copied().filter(|m| ["elastic", "neo_hookean"].contains(m)).collect()
            }
            _ => self.materials.to_vec(),
        }
    }

    /// What may come of it by `method`.
    pub fn expected(&self, method: &str) -> &'static [Verdict] {
        if MPM.contains(&method) { self.expect } else { self.elsewhere }
    }
}

/// Whatever comes of it; a table says what did.
const ANYTHING: &[Verdict] = &[Verdict::Clean, Verdict::Counted, Verdict::TakenBack, Verdict::Refused];

/// Every material of MPM.
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
        "sph" => Material::Sph { viscosity: 1e-3, surface_tension: 0.0 },
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

//! What a user may write in a scene file, as plain data. Knows nothing of files, GPUs or stages.
//!
//! World: right-handed, z up, metres, seconds, kilograms. In a photo scene the origin is the point of the
//! ground under the camera (the camera itself when there is no ground), x is right and y is into the picture.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Collider, Field, Flow, Object, Output, Render};

/// A whole scene file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// The photograph the scene starts from; without it the scene is built from meshes and points.
    #[serde(default)]
    pub photo: Option<Photo>,
    /// The view that is rendered; a photo scene takes it from the photograph when absent.
    #[serde(default)]
    pub camera: Option<Camera>,
    /// The ground plane; absent means none, in a photo scene too.
    #[serde(default)]
    pub ground: Option<Ground>,
    /// Gravity [m/s²].
    #[serde(default = "default_gravity")]
    pub gravity: [f32; 3],
    /// Simulation settings.
    #[serde(default)]
    pub simulation: Simulation,
    /// The bodies.
    #[serde(default, rename = "object")]
    pub objects: Vec<Object>,
    /// Moving or resting obstacles that push bodies and are not pushed.
    #[serde(default, rename = "collider")]
    pub colliders: Vec<Collider>,
    /// Force fields.
    #[serde(default, rename = "field")]
    pub fields: Vec<Field>,
    /// How frames are drawn.
    #[serde(default)]
    pub render: Render,
    /// The network that makes the drawn frames consistent with the input image; absent: none, and no library for it.
    #[serde(default)]
    pub flow: Option<Flow>,
    /// What is written.
    #[serde(default)]
    pub output: Output,
    /// Seed of every random stream.
    #[serde(default)]
    pub seed: u64,
}

fn default_gravity() -> [f32; 3] {
    [0.0, 0.0, -9.81]
}

/// A photograph with its measured depth and the labels of its objects.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Photo {
    /// PNG or JPEG.
    #[schemars(length(min = 1))]
    pub image: PathBuf,
    /// 8-bit image of object labels, same size; 0 is background.
    #[schemars(length(min = 1))]
    pub labels: PathBuf,
    /// Where depth comes from.
    pub depth: Depth,
    /// Focal length of the photograph at its full size [px].
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub focal_px: f32,
    /// Principal point [px]; the image centre when absent.
    #[serde(default)]
    pub principal_px: Option<[f32; 2]>,
    /// World up in camera axes (x right, y down, z forward); absent: taken from the ground, else image up.
    #[serde(default)]
    pub up: Option<[f32; 3]>,
}

/// A depth or disparity map (PNG 8/16, EXR, PFM, NPY), same size as the photograph. 0 and non-finite mean unknown.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Depth {
    /// Depth along the view axis: metres = value · scale.
    Metric {
        /// The depth map.
        #[schemars(length(min = 1))]
        file: PathBuf,
        /// Factor applied to the stored values.
        #[serde(default = "one")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        scale: f32,
    },
    /// Stereo disparity: metres = focal_px · baseline / (value · scale + offset_px).
    Disparity {
        /// The depth map.
        #[schemars(length(min = 1))]
        file: PathBuf,
        /// Distance between the two cameras [m].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        baseline: f32,
        /// Added to the disparity (the crop between the two views) [px].
        #[serde(default)]
        offset_px: f32,
        /// Factor applied to the stored values.
        #[serde(default = "one")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        scale: f32,
    },
}

pub(super) fn one() -> f32 {
    1.0
}

/// A pinhole camera placed in the world.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Position [m].
    pub eye: [f32; 3],
    /// A point on the view axis [m].
    pub target: [f32; 3],
    /// Vertical field of view [degrees], 0 < fov < 180.
    #[serde(default = "default_fov")]
    #[schemars(extend("exclusiveMinimum" = 0.0, "exclusiveMaximum" = 180.0))]
    pub fov_y: f32,
}

fn default_fov() -> f32 {
    40.0
}

/// The ground.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ground {
    /// Height of the plane z = height [m]. In a photo scene: absent means the plane is found below the objects.
    #[serde(default)]
    pub height: Option<f32>,
    /// Coulomb friction coefficient (paper: 0.2).
    #[serde(default = "default_friction")]
    #[schemars(range(min = 0.0))]
    pub friction: f32,
}

pub(crate) fn default_friction() -> f32 {
    0.2
}

/// Settings of the simulation. Defaults are the paper's where it gives them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Simulation {
    /// Grid cells per metre (paper: 128).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub grid_density: f32,
    /// Particles per cell; 8 is a 2×2×2 lattice.
    #[schemars(range(min = 1))]
    pub particles_per_cell: u32,
    /// Spacing of the particles of liquids [m] (paper: 0.013).
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub particle_size: f32,
    /// How liquids find their pressure.
    pub pressure: Pressure,
    /// How liquids of SPH find their viscosity; `plan` says which and why.
    pub viscosity: Viscosity,
    /// Moves the particles of WCSPH in each step to where they are less crowded, whatever their velocities (particle
    /// shifting), and lets the liquid bear tension: flows that turn in a vessel they fill keep their speed, for some more
    /// time a step. Free surfaces do without it better, and do not keep angular momentum with it.
    pub shifting: bool,
    /// Courant number of the elastic wave limit, 0 < C ≤ 1.
    #[schemars(range(max = 1.0), extend("exclusiveMinimum" = 0.0))]
    pub courant: f32,
    /// Largest error of how far held bodies bend, and of the way of those that fall, relative (0.05 is 5 %): the cheapest
    /// density of the grid, or size of particles, and Courant number for it are taken from measured tables, in place of
    /// those given.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub error_budget: Option<f32>,
    /// A fixed step [s] instead of the chosen one, for stress tests.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub force_dt: Option<f32>,
    /// Share ε of their size by which elastic bodies may deform at the largest speed and load to be expected, 0 < ε ≤ 0.5:
    /// they are made no stiffer than that takes, for longer steps. Their vibration and contact last longer then, and `plan`
    /// and the report say by how much; an error budget does not count it. Absent: as stiff as they are. Sand, snow, foam,
    /// plastic bodies and liquids stay as they are, because how they yield goes by their stiffness.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = 0.0))]
    pub stiffness_cap: Option<f32>,
    /// How elastic bodies are solved.
    pub elastic: Elastic,
    /// Same bits on every run on the same device.
    pub deterministic: bool,
    /// Parts of bodies in which nothing moves are left out until something comes near.
    pub sleep: bool,
    /// Largest corner-to-corner box the bodies may reach [m]; absent: twice the bodies' own box. A body in
    /// total-Lagrangian form has no grid to leave.
    pub domain: Option<Domain>,
}

impl Default for Simulation {
    fn default() -> Self {
        Self {
            grid_density: 128.0,
            particles_per_cell: 8,
            particle_size: 0.013,
            pressure: Pressure::default(),
            viscosity: Viscosity::default(),
            shifting: false,
            courant: 0.75,
            error_budget: None,
            force_dt: None,
            stiffness_cap: None,
            elastic: Elastic::Auto,
            deterministic: true,
            sleep: true,
            domain: None,
        }
    }
}

/// How elastic bodies are solved.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Elastic {
    /// In total-Lagrangian form where that is better, else by MPM: what could meet something at more than twice the speed of
    /// its waves, or is so soft or thin that an obstacle narrower than it could come through. Beside sand, liquids and emitters
    /// each body by itself.
    #[default]
    Auto,
    /// On a grid of the body's own at rest: bends and vibrates without loss, neither tears nor flows. What is not elastic,
    /// emitted or recycled stays with MPM.
    TotalLagrangian,
    /// By MPM, on one grid with all other bodies.
    UpdatedLagrangian,
}

/// How SPH finds the pressure of a liquid.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pressure {
    /// By an equation of state: weakly compressible, short steps.
    Wcsph,
    /// Solved for: nearly incompressible, long steps (Bender & Koschier 2015).
    #[default]
    Dfsph,
}

/// How SPH finds the viscosity of a liquid.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Viscosity {
    /// Solved for where that makes steps four times as long.
    Auto,
    /// From the velocities at hand: steps of at most 0.125 h²/ν.
    #[default]
    Explicit,
    /// Solved for: any step (Weiler et al. 2018).
    Implicit,
}

/// An axis-aligned box [m].
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    /// Lowest corner [m].
    pub min: [f32; 3],
    /// Highest corner [m].
    pub max: [f32; 3],
}

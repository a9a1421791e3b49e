//! What a user may write in a scene file, as plain data. Knows nothing of files, GPUs or stages.
//!
//! World: right-handed, z up, metres, seconds, kilograms. In a photo scene the origin is the point of the
//! ground under the camera (the camera itself when there is no ground), x is right and y is into the picture.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

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
    pub image: PathBuf,
    /// 8-bit image of object labels, same size; 0 is background.
    pub labels: PathBuf,
    /// Where depth comes from.
    pub depth: Depth,
    /// Focal length of the photograph at its full size [px].
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
        file: PathBuf,
        #[serde(default = "one")]
        scale: f32,
    },
    /// Stereo disparity: metres = focal_px · baseline / (value · scale + offset_px).
    Disparity {
        file: PathBuf,
        baseline: f32,
        #[serde(default)]
        offset_px: f32,
        #[serde(default = "one")]
        scale: f32,
    },
}

fn one() -> f32 {
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
    /// Vertical field of view [degrees].
    #[serde(default = "default_fov")]
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
    pub friction: f32,
}

fn default_friction() -> f32 {
    0.2
}

/// Settings of the simulation. Defaults are the paper's where it gives them.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Simulation {
    /// Grid cells per metre (paper: 128).
    pub grid_density: f32,
    /// Particles per cell; 8 is a 2×2×2 lattice.
    pub particles_per_cell: u32,
    /// Courant number of the elastic wave limit, 0 < C ≤ 1.
    pub courant: f32,
    /// A fixed step [s] instead of the chosen one, for stress tests.
    pub force_dt: Option<f32>,
    /// Same bits on every run on the same device.
    pub deterministic: bool,
    /// Largest corner-to-corner box the bodies may reach [m]; absent: twice the bodies' own box.
    pub domain: Option<Domain>,
}

impl Default for Simulation {
    fn default() -> Self {
        Self {
            grid_density: 128.0,
            particles_per_cell: 8,
            courant: 0.75,
            force_dt: None,
            deterministic: true,
            domain: None,
        }
    }
}

/// An axis-aligned box [m].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Domain {
    pub min: [f32; 3],
    pub max: [f32; 3],
}

/// A body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Object {
    pub name: String,
    /// Where its geometry comes from.
    pub source: Source,
    /// What it is made of; absent: the object stands still and only occludes.
    #[serde(default)]
    pub material: Option<Material>,
    /// Density [kg/m³] (paper: 40).
    #[serde(default = "default_density")]
    pub density: f32,
    /// Initial velocity [m/s].
    #[serde(default)]
    pub velocity: [f32; 3],
    /// Initial angular velocity about the centre of mass [rad/s].
    #[serde(default)]
    pub angular_velocity: [f32; 3],
    /// Starts at rest under gravity: the shape given is the sagged one. Default: true from a photo, else false.
    #[serde(default)]
    pub prestress: Option<bool>,
    /// Regions of the body that are held where they are.
    #[serde(default)]
    pub pins: Vec<Region>,
    /// Colour of bodies without their own, sRGB 0–1.
    #[serde(default = "default_color")]
    pub color: [f32; 3],
}

fn default_density() -> f32 {
    40.0
}
fn default_color() -> [f32; 3] {
    [0.8, 0.8, 0.8]
}

/// Geometry of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Source {
    /// The pixels of one label of the photograph.
    Mask {
        label: u8,
        #[serde(default)]
        thickness: Thickness,
    },
    /// A closed triangle mesh (OBJ), scaled, then turned about z by `yaw` [degrees], then moved.
    Mesh {
        file: PathBuf,
        #[serde(default = "one")]
        scale: f32,
        #[serde(default)]
        yaw: f32,
        #[serde(default)]
        position: [f32; 3],
    },
    /// Points (PLY or NPZ) used as particles as they are.
    Points {
        file: PathBuf,
        #[serde(default = "one")]
        scale: f32,
        #[serde(default)]
        position: [f32; 3],
    },
    /// A solid box.
    Box { min: [f32; 3], max: [f32; 3] },
    /// A solid ball.
    Ball { center: [f32; 3], radius: f32 },
}

/// How thick the body behind a mask is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Thickness {
    /// Thickness = 2 · scale · distance to the silhouette, clamped to [min, max] [m].
    Inflate { scale: f32, min: f32, max: f32 },
    /// One thickness everywhere [m].
    Extrude(f32),
}

impl Default for Thickness {
    fn default() -> Self {
        Thickness::Inflate { scale: 1.0, min: 0.0, max: 0.5 }
    }
}

/// Material of a body, with the paper's defaults.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Material {
    /// Fixed-corotated elasticity (Stomakhin 2012).
    Elastic {
        /// Young's modulus [Pa].
        #[serde(default = "default_young")]
        young: f32,
        /// Poisson's ratio, 0 ≤ ν < 0.5.
        #[serde(default = "default_poisson")]
        poisson: f32,
    },
    /// Compressible neo-Hookean elasticity.
    NeoHookean {
        /// Young's modulus [Pa].
        #[serde(default = "default_young")]
        young: f32,
        /// Poisson's ratio, 0 ≤ ν < 0.5.
        #[serde(default = "default_poisson")]
        poisson: f32,
    },
}

fn default_young() -> f32 {
    8e4
}
fn default_poisson() -> f32 {
    0.32
}

/// A region of space.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Region {
    /// Axis-aligned box, world [m].
    Box { min: [f32; 3], max: [f32; 3] },
    /// Ball, world [m].
    Ball { center: [f32; 3], radius: f32 },
    /// Rectangle of the photograph at its full size [px]; everything seen through it.
    Pixels { min: [f32; 2], max: [f32; 2] },
    /// Everything within `distance` [m] of another object.
    Near { object: String, distance: f32 },
}

/// An obstacle with prescribed motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Collider {
    pub shape: Shape,
    /// Coulomb friction coefficient; `sticky` ignores it.
    #[serde(default = "default_friction")]
    pub friction: f32,
    /// Bodies stick to it and move with it.
    #[serde(default)]
    pub sticky: bool,
    /// Linear velocity [m/s].
    #[serde(default)]
    pub velocity: [f32; 3],
    /// Angular velocity about its centre [rad/s].
    #[serde(default)]
    pub angular_velocity: [f32; 3],
    /// Motion lasts from `start` to `end` [s].
    #[serde(default)]
    pub start: f32,
    #[serde(default = "forever")]
    pub end: f32,
}

fn forever() -> f32 {
    1e9
}

/// Shape of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Shape {
    /// Half space: points x with (x − point)·normal < 0 are inside the obstacle.
    Plane { point: [f32; 3], normal: [f32; 3] },
    /// Solid box.
    Box { center: [f32; 3], half: [f32; 3] },
    /// Solid ball.
    Ball { center: [f32; 3], radius: f32 },
    /// Room: everything outside the box is obstacle.
    Room { center: [f32; 3], half: [f32; 3] },
}

/// A force field, as an acceleration of the material inside its region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Field {
    pub force: Force,
    /// Where it acts; absent: everywhere.
    #[serde(default)]
    pub region: Option<FieldRegion>,
    /// Acts from `start` to `end` [s].
    #[serde(default)]
    pub start: f32,
    #[serde(default = "forever")]
    pub end: f32,
    /// Rises and falls smoothly over this time at both ends [s].
    #[serde(default)]
    pub ramp: f32,
    /// Names of the bodies it acts on; absent: all.
    #[serde(default)]
    pub objects: Option<Vec<String>>,
}

/// Kind of force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Force {
    /// Wind: acceleration = drag · (velocity · (1 + gust · sin(2π frequency t)) − v).
    Wind {
        /// Air velocity [m/s].
        velocity: [f32; 3],
        /// Drag rate [1/s].
        drag: f32,
        /// Relative size of the gusts.
        #[serde(default)]
        gust: f32,
        /// Gust frequency [Hz].
        #[serde(default)]
        frequency: f32,
    },
    /// A push at a point: acceleration [m/s²] with falloff exp(−r²/(2 radius²)).
    Point { center: [f32; 3], radius: f32, acceleration: [f32; 3] },
    /// Uniform acceleration [m/s²].
    Uniform { acceleration: [f32; 3] },
}

/// Region of a field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum FieldRegion {
    Box { min: [f32; 3], max: [f32; 3] },
    Ball { center: [f32; 3], radius: f32 },
}

/// How points become pixels (paper: PyTorch3D's point renderer).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Render {
    /// Points blended per pixel; 1 is the fast path.
    pub points_per_pixel: u32,
    /// How the points of a pixel are combined.
    pub compositing: Compositing,
    /// Point radius in spacings of the display points.
    pub radius: f32,
    /// Only points within this depth of the nearest are blended [m]; absent: all K, as in PyTorch3D.
    pub blend_depth: Option<f32>,
    /// Colour where nothing is drawn and there is no photograph, sRGB 0–1.
    pub background: [f32; 3],
}

impl Default for Render {
    fn default() -> Self {
        Self {
            points_per_pixel: 8,
            compositing: Compositing::NormWeighted,
            radius: 0.99,
            blend_depth: Some(0.01),
            background: [1.0; 3],
        }
    }
}

/// How the K points of a pixel are combined.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Compositing {
    /// Σ w c / Σ w.
    NormWeighted,
    /// Front to back: Σ w c Π(1 − w).
    Alpha,
}

/// What is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Output {
    /// Width of the frames [px]; the height follows the photograph or is 9/16, made even.
    pub width: u32,
    pub height: Option<u32>,
    pub frames: u32,
    pub fps: f32,
    /// The last thing that is made; what it does not need is skipped.
    pub until: Until,
    /// Particle positions of every frame as NPZ or PLY.
    pub points: Option<PointFormat>,
    /// Colour, depth and object id of every frame as EXR.
    pub exr: bool,
}

impl Default for Output {
    fn default() -> Self {
        Self { width: 640, height: None, frames: 109, fps: 24.0, until: Until::Video, points: None, exr: false }
    }
}

/// How far a run goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Until {
    /// Simulate; report only.
    State,
    /// Also write points.
    Points,
    /// Also draw frames.
    Frames,
    /// Also encode the video.
    Video,
}

/// File format of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PointFormat {
    Npz,
    Ply,
}

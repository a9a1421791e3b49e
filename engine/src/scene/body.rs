//! What a body is: geometry, motion and pins, as plain data. Knows nothing of particles or files' contents.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::model::{default_friction, one};
use super::{Domain, FieldRegion, Material};

/// A body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Name, not empty and different from every other body's.
    #[schemars(length(min = 1))]
    pub name: String,
    /// Where its geometry comes from.
    pub source: Source,
    /// What it is made of; absent: the object stands still and only occludes.
    #[serde(default)]
    pub material: Option<Material>,
    /// Density [kg/m³] (paper: 40).
    #[serde(default = "default_density")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub density: f32,
    /// Coulomb friction coefficient of its surface against other bodies, where one of the two is in total-Lagrangian form; the
    /// smaller counts. Two in MPM stick to each other.
    #[serde(default = "default_friction")]
    #[schemars(range(min = 0.0))]
    pub friction: f32,
    /// Damping time β [s] of an elastic body on a grid of its own: its stress gains β times its rate (Kelvin–Voigt), so a
    /// vibration at f Hz has π f β of critical damping. A jelly's is some 1e-3 s.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub damping: f32,
    /// Initial velocity [m/s].
    #[serde(default)]
    pub velocity: [f32; 3],
    /// Initial angular velocity about the centre of mass [rad/s].
    #[serde(default)]
    pub angular_velocity: [f32; 3],
    /// Gravity of this object alone [m/s²], [0, 0, 9.81] for what rises; absent: the scene's.
    #[serde(default)]
    pub gravity: Option<[f32; 3]>,
    /// Starts at rest under gravity: the shape given is the sagged one. Default: true from a photo, else false.
    #[serde(default)]
    pub prestress: Option<bool>,
    /// Its particles leave the source one after another; absent: all are there from the start.
    #[serde(default)]
    pub emitter: Option<Emitter>,
    /// Where its particles start anew after they have gone; absent: nowhere.
    #[serde(default)]
    pub recycle: Option<Recycle>,
    /// Regions of the body that are held where they are.
    #[serde(default)]
    pub pins: Vec<Region>,
    /// Colour of bodies without their own, sRGB 0–1.
    #[serde(default = "default_color")]
    #[schemars(inner(range(min = 0.0, max = 1.0)))]
    pub color: [f32; 3],
    /// Side of the checks of a pattern that shows how a body without its own colours deforms [m]; absent: plain.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub checks: Option<f32>,
}

fn default_density() -> f32 {
    40.0
}
fn default_color() -> [f32; 3] {
    [0.8, 0.8, 0.8]
}

/// The object's geometry is a nozzle: copies of it leave through the plane at its front, one after another, at the
/// object's velocity, each layer when it is due, so that no two particles meet unless something blocks the way.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Emitter {
    /// When the first particles leave [s].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub start: f32,
    /// When the last ones do [s], after `start`; the default is as good as never.
    #[serde(default = "super::effect::forever")]
    pub end: f32,
    /// Mass that leaves in a second [kg/s]; absent: as much as fits through, without gaps.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub rate: Option<f32>,
    /// How long each particle is there [s]; absent: to the end.
    #[serde(default)]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub lifetime: Option<f32>,
}

/// Particles that reach a region start anew somewhere else: undeformed, at the object's velocity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Recycle {
    /// What they must reach; a cell thick at the least, so that none passes it in a substep.
    pub region: FieldRegion,
    /// Box of the source, apart from the region; each comes to a random place in it, the same on every run. Absent for a
    /// liquid of SPH, whose particles wait for its emitter to send them again.
    #[serde(default)]
    pub to: Option<Domain>,
}

/// Geometry of a body.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Source {
    /// The pixels of one label of the photograph.
    Mask {
        /// Label of the body in the label image, 1–255; 0 is background.
        #[schemars(range(min = 1))]
        label: u8,
        /// How thick the body is behind what is seen of it.
        #[serde(default)]
        thickness: Thickness,
    },
    /// A closed triangle mesh (OBJ), scaled, then turned about z by `yaw` [degrees], then moved.
    Mesh {
        /// The file, relative to the scene's folder.
        #[schemars(length(min = 1))]
        file: PathBuf,
        /// Metres per unit of the file.
        #[serde(default = "one")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        scale: f32,
        /// Turn about z [degrees].
        #[serde(default)]
        yaw: f32,
        /// Where the file's origin goes [m].
        #[serde(default)]
        position: [f32; 3],
    },
    /// Points (PLY or NPZ) used as particles as they are.
    Points {
        /// The file, relative to the scene's folder.
        #[schemars(length(min = 1))]
        file: PathBuf,
        /// Metres per unit of the file.
        #[serde(default = "one")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        scale: f32,
        /// Where the file's origin goes [m].
        #[serde(default)]
        position: [f32; 3],
    },
    /// A solid box.
    Box {
        /// Lowest corner [m].
        min: [f32; 3],
        /// Highest corner [m].
        max: [f32; 3],
    },
    /// A solid ball.
    Ball {
        /// Centre [m].
        center: [f32; 3],
        /// Radius [m].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        radius: f32,
    },
}

/// How thick the body behind a mask is.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Thickness {
    /// Thickness = 2 · scale · distance to the silhouette, clamped to [min, max] [m].
    Inflate {
        /// Factor on the silhouette distance.
        #[serde(default = "one")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        scale: f32,
        /// Least thickness [m].
        #[serde(default)]
        #[schemars(range(min = 0.0))]
        min: f32,
        /// Greatest thickness [m].
        #[serde(default = "default_max_thickness")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        max: f32,
    },
    /// One thickness everywhere [m].
    Extrude(
        /// Thickness [m].
        #[schemars(range(min = 0.0))]
        f32,
    ),
}

impl Default for Thickness {
    fn default() -> Self {
        Thickness::Inflate { scale: one(), min: 0.0, max: default_max_thickness() }
    }
}

fn default_max_thickness() -> f32 {
    0.5
}

/// A region of space.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Region {
    /// Axis-aligned box, world [m].
    Box {
        /// Lowest corner [m].
        min: [f32; 3],
        /// Highest corner [m].
        max: [f32; 3],
    },
    /// Ball, world [m].
    Ball {
        /// Centre [m].
        center: [f32; 3],
        /// Radius [m].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        radius: f32,
    },
    /// Rectangle of the photograph at its full size [px]; everything seen through it.
    Pixels {
        /// Upper left corner [px].
        min: [f32; 2],
        /// Lower right corner [px].
        max: [f32; 2],
    },
    /// Everything within `distance` [m] of another object.
    Near {
        /// Name of the other object.
        object: String,
        /// Reach [m].
        #[schemars(range(min = 0.0))]
        distance: f32,
    },
}

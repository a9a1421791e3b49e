//! What acts on bodies from outside: colliders and force fields, as plain data, and what the kernels get of them. Knows
//! nothing of solvers.

use physvideo_gpu::kernels;
use physvideo_gpu::kernels::family::{field, shape};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::model::default_friction;
use crate::world::vec4;

/// An obstacle with prescribed motion.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Collider {
    /// Its shape at time 0.
    pub shape: Shape,
    /// Coulomb friction coefficient; `sticky` ignores it.
    #[serde(default = "default_friction")]
    #[schemars(range(min = 0.0))]
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
    /// When its motion starts [s].
    #[serde(default)]
    pub start: f32,
    /// When it ends [s], after `start`; the default is as good as never.
    #[serde(default = "forever")]
    pub end: f32,
}

pub(super) fn forever() -> f32 {
    1e9
}

/// Shape of a collider.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum Shape {
    /// Half space: points x with (x − point)·normal < 0 are inside the obstacle.
    Plane {
        /// A point of the plane [m].
        point: [f32; 3],
        /// Out of the obstacle, any length but 0.
        normal: [f32; 3],
    },
    /// Solid box.
    Box {
        /// Centre [m].
        center: [f32; 3],
        /// Half of its size along each axis [m], all above 0.
        half: [f32; 3],
    },
    /// Solid ball.
    Ball {
        /// Centre [m].
        center: [f32; 3],
        /// Radius [m].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        radius: f32,
    },
    /// Room: everything outside the box is obstacle.
    Room {
        /// Centre [m].
        center: [f32; 3],
        /// Half of its size along each axis [m], all above 0.
        half: [f32; 3],
    },
}

impl Shape {
    /// Number among the kernels' shapes, centre [m], and size: half extents, radius or normal.
    pub fn constants(&self) -> (u32, [f32; 3], [f32; 3]) {
        match *self {
            Shape::Plane { point, normal } => {
                (shape::PLANE, point, glam::Vec3::from(normal).normalize_or(glam::Vec3::Z).to_array())
            }
            Shape::Ball { center, radius } => (shape::BALL, center, [radius, 0.0, 0.0]),
            Shape::Box { center, half } => (shape::BOX, center, half),
            Shape::Room { center, half } => (shape::ROOM, center, half),
        }
    }
}

/// A force field, as an acceleration of the material inside its region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Field {
    /// What it does.
    pub force: Force,
    /// Where it acts; absent: everywhere.
    #[serde(default)]
    pub region: Option<FieldRegion>,
    /// When it starts to act [s].
    #[serde(default)]
    pub start: f32,
    /// When it ends [s], after `start`; the default is as good as never.
    #[serde(default = "forever")]
    pub end: f32,
    /// Rises and falls smoothly over this time at both ends [s].
    #[serde(default)]
    #[schemars(range(min = 0.0))]
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
        #[schemars(range(min = 0.0))]
        drag: f32,
        /// Relative size of the gusts.
        #[serde(default)]
        #[schemars(range(min = 0.0))]
        gust: f32,
        /// Gust frequency [Hz].
        #[serde(default)]
        #[schemars(range(min = 0.0))]
        frequency: f32,
    },
    /// A push at a point: acceleration [m/s²] with falloff exp(−r²/(2 radius²)).
    Point {
        /// Where the push is centred [m].
        center: [f32; 3],
        /// Standard deviation of the falloff [m].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        radius: f32,
        /// Acceleration at the centre [m/s²].
        acceleration: [f32; 3],
    },
    /// Uniform acceleration [m/s²].
    Uniform {
        /// Acceleration [m/s²].
        acceleration: [f32; 3],
    },
    /// A curl: acceleration = strength · exp(−r/radius) · sin(2π frequency t) along the circles around an axis, r the
    /// distance from it (paper's steam: radius 0.20, axis z). Counter-clockwise seen from the axis's tip.
    Vortex {
        /// A point of the axis [m].
        center: [f32; 3],
        /// Direction of the axis, any length but 0.
        #[serde(default = "upward")]
        axis: [f32; 3],
        /// Acceleration next to the axis [m/s²]; below 0 it turns the other way.
        strength: f32,
        /// Distance over which it falls off [m].
        #[serde(default = "default_radius")]
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        radius: f32,
        /// How often it swings to and fro [Hz]; 0: steady.
        #[serde(default)]
        #[schemars(range(min = 0.0))]
        frequency: f32,
    },
    /// Random pushes, smooth in space and time, with mean 0: turbulence, or the diffusion of steam, which grows with
    /// height. The same for the same seed on every device.
    Noise {
        /// Standard deviation of each component at the height `from` [m/s²].
        #[schemars(range(min = 0.0))]
        amplitude: f32,
        /// What the standard deviation gains per metre of height [1/s²]; where it would be below 0 nothing acts.
        #[serde(default)]
        growth: f32,
        /// Height at which it is `amplitude` [m].
        #[serde(default)]
        from: f32,
        /// Correlation length [m]: half of the correlation is left over 0.7 of it, a fifth over one, none over two.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        length: f32,
        /// Correlation time [s], likewise.
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        time: f32,
        /// Factors of its components; [1, 1, 0] pushes sideways only.
        #[serde(default = "all_axes")]
        axes: [f32; 3],
    },
    /// Linear drag of each component of the velocity: acceleration = −rate · velocity.
    Damping {
        /// Rate of each component [1/s]; [0, 0, 5] slows only what rises or falls.
        #[schemars(inner(range(min = 0.0)))]
        rate: [f32; 3],
    },
}

fn upward() -> [f32; 3] {
    [0.0, 0.0, 1.0]
}
fn default_radius() -> f32 {
    0.2
}
fn all_axes() -> [f32; 3] {
    [1.0; 3]
}

impl Force {
    /// Writes its number among the kernels' fields and its parameters. `stream` is what makes one noise differ from
    /// another: whole numbers below 2²⁴.
    pub fn write(&self, stream: [f32; 2], out: &mut kernels::Field) {
        match *self {
            Force::Wind { velocity, drag, gust, frequency } => {
                (out.kind, out.a) = (field::WIND, vec4(velocity));
                (out.p0, out.p1, out.p2) = (drag, gust, frequency);
            }
            Force::Point { center, radius, acceleration } => {
                (out.kind, out.a, out.b) = (field::POINT, vec4(acceleration), vec4(center));
                out.p0 = radius;
            }
            Force::Uniform { acceleration } => {
                (out.kind, out.a) = (field::UNIFORM, vec4(acceleration));
            }
            Force::Vortex { center, axis, strength, radius, frequency } => {
                let axis = glam::Vec3::from(axis).normalize_or(glam::Vec3::Z).to_array();
                (out.kind, out.a, out.b) = (field::VORTEX, vec4(axis), vec4(center));
                (out.p0, out.p1, out.p2) = (strength, radius, frequency);
            }
            Force::Noise { amplitude, growth, from, length, time, axes } => {
                (out.kind, out.a, out.b) = (field::NOISE, vec4(axes), [time, stream[0], stream[1], 0.0]);
                out.a[3] = length;
                (out.p0, out.p1, out.p2) = (amplitude, growth, from);
            }
            Force::Damping { rate } => (out.kind, out.a) = (field::DAMPING, vec4(rate)),
        }
    }
}

/// Region of a field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, rename_all = "snake_case")]
pub enum FieldRegion {
    /// Axis-aligned box, world.
    Box {
        /// Lowest corner [m].
        min: [f32; 3],
        /// Highest corner [m].
        max: [f32; 3],
    },
    /// Ball, world.
    Ball {
        /// Centre [m].
        center: [f32; 3],
        /// Radius [m].
        #[schemars(extend("exclusiveMinimum" = 0.0))]
        radius: f32,
    },
}

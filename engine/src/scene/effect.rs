//! What acts on bodies from outside: colliders and force fields, as plain data. Knows nothing of solvers.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::model::default_friction;

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

fn forever() -> f32 {
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

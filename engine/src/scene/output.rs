//! How frames are drawn and what is written, as plain data. Knows nothing of encoders or pixels.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How points become pixels (paper: PyTorch3D's point renderer).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Render {
    /// Points blended per pixel; 1 is the fast path.
    #[schemars(range(min = 1))]
    pub points_per_pixel: u32,
    /// How the points of a pixel are combined.
    pub compositing: Compositing,
    /// Point radius in spacings of the display points.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub radius: f32,
    /// Only points within this depth of the nearest are blended [m]; absent: all K, as in PyTorch3D.
    #[schemars(range(min = 0.0))]
    pub blend_depth: Option<f32>,
    /// Colour where nothing is drawn and there is no photograph, sRGB 0–1.
    #[schemars(inner(range(min = 0.0, max = 1.0)))]
    pub background: [f32; 3],
    /// Direction to a light that shades bodies without their own colours as they stand at the start; absent: flat.
    pub light: Option<[f32; 3]>,
}

impl Default for Render {
    fn default() -> Self {
        Self {
            points_per_pixel: 8,
            compositing: Compositing::NormWeighted,
            radius: 0.99,
            blend_depth: Some(0.01),
            background: [1.0; 3],
            light: None,
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
    /// Width of the frames [px], 16–8192.
    #[schemars(range(min = 16, max = 8192))]
    pub width: u32,
    /// Height of the frames [px], 16–8192; absent: follows the photograph or is 9/16 of the width, made even.
    #[schemars(range(min = 16, max = 8192))]
    pub height: Option<u32>,
    /// Number of frames (paper: 109).
    #[schemars(range(min = 1))]
    pub frames: u32,
    /// Frames per second of the video and of the simulated time.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
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
    /// Also refine the frames by the network, where the scene has one, and encode the videos.
    Video,
}

/// File format of points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum PointFormat {
    /// NumPy archive.
    Npz,
    /// Binary PLY.
    Ply,
}

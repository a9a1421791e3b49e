//! Φ_CF, the paper's Consistency-Guided Flow SDE, as plain data: which network, which act, how it is integrated. Knows
//! nothing of networks or devices.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The video made consistent by an image-to-video flow network (paper, Sec. 3.3 and Algorithm 1).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Flow {
    /// Folder of the network's `model.toml`.
    #[schemars(length(min = 1))]
    pub model: PathBuf,
    /// Frames, masks and images to start from instead of the simulated scene.
    #[serde(default)]
    pub input: Option<FlowInput>,
    /// Which of the paper's two uses (lines 7 and 12 of Algorithm 1 differ).
    #[serde(default)]
    pub act: Act,
    /// Size the frames are scaled to for the network [px], width and height; absent: the output size, made to fit.
    #[serde(default)]
    pub size: Option<[u32; 2]>,
    /// Steps of the noise schedule; absent: the model's own (paper: 25).
    #[serde(default)]
    #[schemars(range(min = 1, max = 1000))]
    pub steps: Option<u32>,
    /// Step of the schedule, from the clean end, at which the SDE runs; absent: four fifths of them (paper: 20 of 25).
    #[serde(default)]
    #[schemars(range(min = 1, max = 1000))]
    pub tau_step: Option<u32>,
    /// Iterations of the SDE, N; 0 is plain generation from the start latent (paper: 10).
    #[serde(default = "default_iterations")]
    #[schemars(range(max = 100_000))]
    pub iterations: u32,
    /// Step size γ of the SDE (paper: 0.2); stable for any data below 2σ² at the noise level σ of `tau_step`.
    #[serde(default = "default_gamma")]
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub gamma: f32,
    /// Weight β of consistency against the start distribution; absent: (1 − σ)/σ, the paper's.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub beta: Option<f32>,
    /// Integrator of the SDE.
    #[serde(default)]
    pub sde: Sde,
    /// Integrator of generation and inversion, F and F⁻¹.
    #[serde(default)]
    pub solver: Solver,
    /// Where the start latent comes from.
    #[serde(default)]
    pub start: Start,
    /// How pixels of the mask become cells of the latent.
    #[serde(default)]
    pub mask: MaskRule,
    /// Guidance scale of generation and SDE; absent: the model's own.
    #[serde(default)]
    #[schemars(range(min = 0.0))]
    pub guidance: Option<f32>,
    /// Guidance scale of the inversion, for networks guided by two predictions; 1 follows the conditional one alone.
    #[serde(default = "one")]
    #[schemars(range(min = 0.0))]
    pub inversion_guidance: f32,
    /// What is asked for in words; kept in the report. Networks read `embeddings`.
    #[serde(default)]
    pub prompt: String,
    /// The prompt as the network's own encoders gave it: an NPZ file of the arrays that its manifest names.
    #[serde(default)]
    pub embeddings: Option<PathBuf>,
    /// The same for what guidance leads away from.
    #[serde(default)]
    pub negative_embeddings: Option<PathBuf>,
    /// Image that conditions a chunk after the first.
    #[serde(default)]
    pub continuation: Continuation,
    /// Noise of the chunks: one stream each, or the same for all.
    #[serde(default)]
    pub noise: Noise,
}

fn default_iterations() -> u32 {
    10
}
fn default_gamma() -> f32 {
    0.2
}
fn one() -> f32 {
    1.0
}

impl Flow {
    /// The step of the SDE in a schedule of `steps`.
    pub fn tau_of(&self, steps: usize) -> usize {
        self.tau_step.map_or_else(|| (4 * steps + 2) / 5, |t| t as usize).max(1)
    }
}

/// A driving video from files. Folders hold PNG files that are taken in the order of their names.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FlowInput {
    /// Folder of frames.
    #[schemars(length(min = 1))]
    pub frames: PathBuf,
    /// Folder of masks of the same size and number, white where the frames guide; absent: everywhere.
    #[serde(default)]
    pub masks: Option<PathBuf>,
    /// The image to be consistent with; absent: the first frame.
    #[serde(default)]
    pub image: Option<PathBuf>,
    /// What is behind the moving things; absent: the image.
    #[serde(default)]
    pub background: Option<PathBuf>,
}

/// The paper's two uses of Φ_CF.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Act {
    /// Paper's stage 1: known pixels stay, the SDE fills the rest.
    Reconstruct,
    /// Paper's stage 2: the SDE refines what moves, over noise of the background.
    #[default]
    Animate,
}

/// Integrators of the SDE; their laws are in tests/tests/flow and assets/wp.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Sde {
    /// The paper's (eq. 5).
    #[default]
    EulerMaruyama,
    /// Euler–Maruyama with noise of variance 2γ − (γ/τ)²: exact for point data; γ ≤ 2τ².
    VarianceCorrected,
    /// Leimkuhler & Matthews 2013: second order in the stationary law at the same cost.
    LeimkuhlerMatthews,
    /// Exponential in the predicted clean latent: stable for every γ.
    Exponential,
}

/// Integrators of the flow's ordinary differential equation.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Solver {
    /// One evaluation a step, first order.
    #[default]
    Euler,
    /// Adams–Bashforth: one evaluation a step, second order.
    Ab2,
    /// Two evaluations a step, second order.
    Heun,
}

/// Where the start latent comes from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// Inversion inside the mask, noise outside (Algorithm 1).
    #[default]
    Inversion,
    /// The frames' latent with noise, (1 − σ) z + σ ε (paper, supplement B).
    Forward,
}

/// How pixels of the mask become cells of the latent.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct MaskRule {
    /// Absent: `all` for the act reconstruct (known only where every pixel is), `any` for animate.
    pub pool: Option<Pool>,
    /// Cells by which the mask grows, or for `all` shrinks; absent: 1 for `any` (shadows, reflections), else 0.
    #[schemars(range(max = 64))]
    pub reach: Option<u32>,
}

/// When a cell belongs to the mask.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Pool {
    /// When all of its pixels do.
    All,
    /// When any of its pixels does.
    Any,
    /// By the share of its pixels, with steps scaled cell by cell; for Euler–Maruyama and Leimkuhler–Matthews.
    Share,
}

/// Image that conditions a chunk after the first.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Continuation {
    /// The last frame of the chunk before.
    #[default]
    LastFrame,
    /// The input image, as for the first chunk.
    FirstImage,
}

/// Noise of the chunks.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Noise {
    /// A stream for each chunk.
    #[default]
    Chunk,
    /// The same for all chunks.
    Shared,
}

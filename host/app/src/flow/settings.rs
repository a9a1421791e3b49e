//! How a clip is made, with everything decided that a scene may leave open. Opens nothing.

use physvideo::scene::{Act, Continuation, Noise, Pool, Sde, Solver, Start};
use physvideo_net::{Embeddings, StepIndex};

/// How a clip is made, with everything decided.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Which of the paper's stages.
    pub act: Act,
    /// Steps of the schedule; absent: the model's own.
    pub steps: Option<usize>,
    /// Step at which the SDE runs.
    pub tau: StepIndex,
    /// Iterations N.
    pub iterations: u32,
    /// Step size γ.
    pub gamma: f64,
    /// β; absent: the paper's.
    pub beta: Option<f64>,
    /// The SDE's integrator.
    pub sde: Sde,
    /// F and F⁻¹.
    pub solver: Solver,
    /// Inversion or noise.
    pub start: Start,
    /// How masks become cells.
    pub pool: Pool,
    /// Cells by which they grow or shrink.
    pub reach: u32,
    /// Guidance; absent: the model's own.
    pub guidance: Option<f64>,
    /// Guidance of the inversion.
    pub inversion_guidance: f64,
    /// Arrays of the prompt, and of what guidance leads away from.
    pub embeddings: [Option<Embeddings>; 2],
    /// What conditions later chunks.
    pub continuation: Continuation,
    /// Noise of the chunks.
    pub noise: Noise,
    /// Seed of the scene.
    pub seed: u64,
}

impl Settings {
    /// Steps of inversion, SDE and generation of a chunk.
    pub fn steps_of_chunk(&self) -> [u32; 3] {
        let tau = self.tau.0 as u32;
        [if self.start == Start::Inversion { tau } else { 0 }, self.iterations, tau]
    }
}

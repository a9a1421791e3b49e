//! What was done to the chunks of a clip, for reports and checkpoints. Does nothing itself.

use physvideo::scene::Act;
use physvideo_net::Tensor;
use serde::{Deserialize, Serialize};

use super::algorithm::{Guide, Outcome, updated};
use super::chunks::Stretch;

/// What was done to a chunk.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ChunkReport {
    /// First and last frame.
    pub frames: [usize; 2],
    /// Evaluations of v_θ: inversion, SDE, generation.
    pub nfe: [u32; 3],
    /// Calls of the network: two for an evaluation with guidance by two predictions.
    pub calls: u32,
    /// Wall time of the chunk, encoding and decoding included [s].
    pub wall_s: f64,
    /// Wall time inside the velocity network [s].
    pub network_s: f64,
    /// Time of the latent's arithmetic by the device's own clock [s].
    pub arithmetic_s: f64,
    /// Wall time of that arithmetic with handing it over and waiting for it [s].
    pub latent_s: f64,
    /// Root mean square of the latent before the SDE and after each of its iterations (the paper's norm / √elements).
    pub rms: Vec<f64>,
    /// Share of cells that the SDE updated.
    pub updated: f64,
    /// Noise level σ of the SDE.
    pub sigma: f64,
    /// β used.
    pub beta: f64,
}

/// What was done to a clip.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct ClipReport {
    /// Noise level σ of the SDE.
    pub sigma: f64,
    /// β used.
    pub beta: f64,
    /// The chunks, in order of running.
    pub chunks: Vec<ChunkReport>,
}

/// A chunk that an earlier run finished.
#[derive(Clone, Debug, PartialEq)]
pub struct Finished {
    /// z*.
    pub latent: Tensor,
    /// What was done.
    pub report: ChunkReport,
}

impl ChunkReport {
    /// Of Algorithm 1's outcome at noise level σ with β; its wall time is not known yet.
    pub(super) fn new(at: Stretch, outcome: &Outcome, act: Act, guide: &Guide, (sigma, beta): (f64, f64)) -> Self {
        let weights = updated(act, guide);
        Self {
            frames: [at.first, at.first + at.frames - 1],
            nfe: outcome.nfe,
            calls: outcome.calls,
            wall_s: 0.0,
            network_s: outcome.network_s,
            arithmetic_s: outcome.arithmetic_s,
            latent_s: outcome.latent_s,
            rms: outcome.stats.iter().map(|s| s.rms).collect(),
            updated: weights.iter().map(|w| f64::from(*w)).sum::<f64>() / weights.len().max(1) as f64,
            sigma,
            beta,
        }
    }
}

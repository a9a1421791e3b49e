//! What Algorithm 1 asks of a network, and everything that can go wrong with it. Does not know where velocities come
//! from: a network, or a formula in tests and benches.

use physvideo::flow::SdeError;
use physvideo_gpu::GpuError;
use physvideo_net::{Branch, Coefficients, NetError, Sigma};

/// A velocity v_θ(z, z_I, σ) as raw predictions and how to read them.
pub trait Velocity {
    /// What follows the latent in the tensor that [`Velocity::evaluate`] is given.
    fn tail(&self) -> &[f32];
    /// True when the velocity is the prediction but for a factor that no noise level changes.
    fn plain(&self) -> bool;
    /// How to read predictions at a noise level.
    fn coefficients(&self, sigma: Sigma) -> Coefficients;
    /// Evaluates at a tensor (the latent, then the tail); `out` becomes the raw prediction in the latent's order.
    ///
    /// # Errors
    /// What the network says; [`NetError`] of kind `Interrupted` when the user stopped it.
    fn evaluate(&mut self, tensor: &[f32], sigma: Sigma, branch: Branch, out: &mut Vec<f32>) -> Result<(), NetError>;
}

/// Why Φ_CF did not come to its end.
#[derive(Debug, thiserror::Error)]
pub enum FlowError {
    /// The network, its library or its files.
    #[error(transparent)]
    Net(#[from] NetError),
    /// The device refused.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The SDE cannot be integrated as asked.
    #[error(transparent)]
    Sde(#[from] SdeError),
    /// A network's prediction is not a number.
    #[error(
        "the velocity network gave {count} values that are not finite, the first at element {first}, in {at} at noise \
         level σ = {sigma:.4}. Lower flow.gamma or flow.guidance, look for NaN in flow.embeddings, or export the network \
         in a wider type"
    )]
    NotFinite {
        /// How many values.
        count: usize,
        /// Index of the first.
        first: usize,
        /// Phase and step.
        at: String,
        /// Noise level.
        sigma: f64,
    },
    /// An encoder or a decoder gave what is not a number.
    #[error(
        "the network `{network}` gave {count} values that are not finite, for {what}. Export it in a wider type (half \
         precision overflows in some decoders)"
    )]
    CodecNotFinite {
        /// Its role.
        network: &'static str,
        /// How many values.
        count: usize,
        /// Which frames.
        what: String,
    },
    /// The latent grew beyond numbers, as it does above the stability limit of γ.
    #[error(
        "the latent is no longer finite after iteration {iteration} of the SDE (σ = {sigma:.4}): gamma {gamma} is beyond \
         what this network is stable for. Any data are stable below 2σ² = {limit:.4}; guidance lowers that"
    )]
    Diverged {
        /// Iteration, from 1.
        iteration: u32,
        /// Noise level.
        sigma: f64,
        /// Step size.
        gamma: f64,
        /// 2σ².
        limit: f64,
    },
    /// The user stopped it.
    #[error("interrupted in {at}; {}", if *kept {
        "what was finished of the flow is kept, and the same command goes on from it"
    } else {
        "nothing of the flow could be kept"
    })]
    Interrupted {
        /// Phase and step.
        at: String,
        /// Whether there is a checkpoint.
        kept: bool,
    },
    /// What the scene asks for does not fit the model.
    #[error("{0}")]
    Input(String),
    /// More memory than there is.
    #[error(
        "the run needs about {need} bytes of {of} memory with its flow, and {available} are available. Lower flow.size"
    )]
    Memory {
        /// `device` or `host`.
        of: &'static str,
        /// Bytes predicted.
        need: u64,
        /// Bytes available.
        available: u64,
    },
}

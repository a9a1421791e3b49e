//! The latent of a chunk on the device: `space` runs the steps of Algorithm 1 on it, `mask` turns pixel masks into
//! weights of its cells. Knows coefficients and predictions, not where either comes from.

pub mod mask;
mod space;

pub use space::LatentSpace;

/// How a raw prediction p becomes a velocity towards the data: v = `scale` p + `latent` z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Factor of the prediction.
    pub scale: f64,
    /// Factor of the latent.
    pub latent: f64,
    /// Guidance scale w, p = pᵤ + w (p_c − pᵤ); absent: there is one prediction.
    pub guidance: Option<f64>,
}

/// Which noise: the same key gives the same numbers on every device and in every order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoiseKey {
    /// The scene's seed.
    pub seed: u64,
    /// Stream, derived from what the noise is for.
    pub stream: u32,
}

/// What a latent is like as a whole.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LatentStats {
    /// Elements that are not finite; the others make mean and rms.
    pub faults: u64,
    /// Mean.
    pub mean: f64,
    /// Root of the mean square; times √count it is the norm.
    pub rms: f64,
}

/// What a latent space is made for.
#[derive(Clone, Debug, Default)]
pub struct LatentSetup<'a> {
    /// Numbers of the latent; a multiple of 4.
    pub elements: u64,
    /// Cells of a channel.
    pub cells: u64,
    /// What follows the latent in the tensor that the network reads.
    pub tail: &'a [f32],
    /// Two predictions are combined.
    pub guided: bool,
    /// The velocity depends on the latent too, or must be kept apart from the prediction.
    pub apart: bool,
    /// A second velocity is kept (AB2, Heun).
    pub history: bool,
    /// Encoded latent that the SDE is anchored to, with a β that is not the paper's.
    pub anchor: Option<&'a [f32]>,
    /// Weight of each cell in steps of the flow: 0 holds it; absent: none is held.
    pub free: Option<&'a [f32]>,
}

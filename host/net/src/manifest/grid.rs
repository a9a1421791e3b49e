//! Sizes of clips in latents. Reads no file.

use super::{FirstLatent, LatentSpec, Manifest};
use crate::error::NetError;
use crate::prediction::Coefficients;
use crate::schedule::{Schedule, Sigma};

/// Size of latents: in time, rows, columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub struct Grid {
    /// Latents in time.
    pub frames: usize,
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
}

impl Grid {
    /// Latents of one channel.
    pub fn len(self) -> usize {
        self.frames * self.height * self.width
    }

    /// Whether it holds nothing.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Tokens of a patch in time, rows, columns.
    pub(crate) fn tokens(self, patch: [usize; 3]) -> Result<usize, NetError> {
        let sizes = [self.frames, self.height, self.width];
        if sizes.iter().zip(patch).any(|(n, p)| p == 0 || n % p != 0) {
            let [t, h, w] = sizes;
            return Err(NetError::usage(format!("latents of {t} x {h} x {w} do not divide into patches of {patch:?}")));
        }
        Ok(sizes.iter().zip(patch).map(|(n, p)| n / p).product())
    }
}

impl Manifest {
    /// Size in latents of a chunk: its frames with its first, and its height and width in pixels.
    ///
    /// # Errors
    /// Sizes that do not divide, with the nearest that do; sizes the model does not take.
    pub fn grid(&self, frames: usize, height: usize, width: usize) -> Result<Grid, NetError> {
        let latent = &self.latent;
        let name = &self.name;
        if self.chunk.fixed && frames != self.chunk.frames {
            let text = format!("model {name}: a chunk has {} frames, not {frames}", self.chunk.frames);
            return Err(NetError::usage(text));
        }
        let t = latents_of(latent, frames).map_err(|e| NetError::usage(format!("model {name}: {e}")))?;
        let t = if latent.first == FirstLatent::Separate { t - 1 } else { t };
        if t == 0 {
            let least = 1 + latent.temporal;
            return Err(NetError::usage(format!("model {name}: a chunk has at least {least} frames, not {frames}")));
        }
        let side = |what: &str, pixels: usize, only: Option<usize>| {
            let step = latent.spatial * latent.multiple;
            match only {
                Some(only) if pixels != only * latent.spatial => Err(NetError::usage(format!(
                    "model {name}: the {what} must be {} pixels, is {pixels}",
                    only * latent.spatial
                ))),
                _ if pixels == 0 || !pixels.is_multiple_of(step) => {
                    let below = pixels / step * step;
                    let near = if below == 0 { step.to_string() } else { format!("{below} or {}", below + step) };
                    Err(NetError::usage(format!(
                        "model {name}: the {what} must be a multiple of {step} pixels, is {pixels}; nearest: {near}"
                    )))
                }
                _ => Ok(pixels / latent.spatial),
            }
        };
        Ok(Grid {
            frames: t,
            height: side("height", height, latent.size.map(|s| s[0]))?,
            width: side("width", width, latent.size.map(|s| s[1]))?,
        })
    }

    /// The noise levels of its steps for this size.
    ///
    /// # Errors
    /// A model without a velocity network; latents that do not divide into the schedule's tokens.
    pub fn schedule(&self, grid: Grid) -> Result<Schedule, NetError> {
        let velocity = self.velocity.as_ref();
        let velocity =
            velocity.ok_or_else(|| NetError::usage(format!("model {} has no velocity network", self.name)))?;
        Schedule::new(&velocity.schedule, grid)
    }

    /// The coefficients of its prediction at one noise level, held at its `least_sigma`.
    ///
    /// # Errors
    /// A model without a velocity network.
    pub fn coefficients(&self, sigma: Sigma) -> Result<Coefficients, NetError> {
        let velocity = self.velocity.as_ref();
        let velocity =
            velocity.ok_or_else(|| NetError::usage(format!("model {} has no velocity network", self.name)))?;
        Ok(velocity.coefficients(sigma))
    }
}

/// Latents in time of some frames, the first alone. The error names the nearest counts that divide.
pub(crate) fn latents_of(latent: &LatentSpec, frames: usize) -> Result<usize, String> {
    let step = latent.temporal;
    if frames == 0 || !(frames - 1).is_multiple_of(step) {
        let below = frames.saturating_sub(1) / step * step + 1;
        let near = if frames == 0 { "1".to_owned() } else { format!("{below} or {}", below + step) };
        return Err(format!("frames must be 1 + a multiple of {step}, are {frames}; nearest: {near}"));
    }
    Ok(1 + (frames - 1) / step)
}

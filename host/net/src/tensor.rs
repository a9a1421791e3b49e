//! Numbers with a shape, as callers see them: latents [C, T, h, w] and frames [3, F, H, W]. Knows no layout but this.

use crate::error::NetError;

/// An array in C order. Latents are [channels, latents in time, rows, columns]; frames are [3, frames, rows, columns],
/// sRGB-encoded, 0 to 1.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Tensor {
    /// Length of each axis.
    pub shape: Vec<usize>,
    /// The numbers; as many as the product of `shape`.
    pub data: Vec<f32>,
}

impl Tensor {
    /// A tensor of numbers that are already there.
    ///
    /// # Errors
    /// When their count is not the product of the shape.
    pub fn new(shape: Vec<usize>, data: Vec<f32>) -> Result<Self, NetError> {
        if count(&shape) != Some(data.len()) {
            return Err(NetError::usage(format!("{} numbers are no tensor of shape {shape:?}", data.len())));
        }
        Ok(Self { shape, data })
    }

    /// A tensor of one value.
    ///
    /// # Errors
    /// When the shape is larger than memory can be.
    pub fn filled(shape: Vec<usize>, value: f32) -> Result<Self, NetError> {
        let n = count(&shape).ok_or_else(|| NetError::usage(format!("{shape:?} is no shape of a tensor")))?;
        Ok(Self { data: vec![value; n], shape })
    }

    /// The four axes of latents or frames, checked against the data. `what` is for messages.
    pub(crate) fn axes(&self, what: &str) -> Result<[usize; 4], NetError> {
        let axes = <[usize; 4]>::try_from(self.shape.as_slice()).ok();
        axes.filter(|_| count(&self.shape) == Some(self.data.len())).ok_or_else(|| {
            let (shape, n) = (&self.shape, self.data.len());
            NetError::usage(format!("{what} must have four axes, and has shape {shape:?} with {n} numbers"))
        })
    }
}

/// The product of a shape, where it fits.
pub(crate) fn count(shape: &[usize]) -> Option<usize> {
    shape.iter().try_fold(1usize, |n, &d| n.checked_mul(d)).filter(|&n| n <= isize::MAX as usize / 8)
}

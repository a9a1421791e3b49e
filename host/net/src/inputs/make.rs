//! One input of the velocity network, as far as it is known before z and the noise level. Runs no network.

use super::parts::Condition;
use super::{Branch, Conditioning, Own, Prepared, WithHole};
use crate::array::{Array, Plain};
use crate::error::NetError;
use crate::layout::{shape, to_graph};
use crate::manifest::{Guidance, Manifest, Source, VelocitySpec};
use crate::numbers::{indices, number};

/// All that inputs are made from.
pub(super) struct Maker<'a> {
    pub manifest: &'a Manifest,
    pub velocity: &'a VelocitySpec,
    pub c: &'a Conditioning,
    pub own: &'a Own<'a>,
    pub condition: Condition<'a>,
}

impl Maker<'_> {
    /// The input of this number.
    pub fn prepare(&self, i: usize, branch: Branch) -> Result<Prepared, NetError> {
        let (spec, grid) = (&self.velocity.inputs[i], self.c.grid);
        let dtype = spec.dtype;
        let array = match &spec.source {
            Source::Latent(latent) => {
                let (data, axes, holes) = self.condition.join(latent, branch)?;
                if !holes.is_empty() {
                    let layout = latent.layout;
                    return Ok(Prepared::Latents(WithHole { data, axes, holes, layout, dtype }));
                }
                Array::from_f32(shape(axes, latent.layout), &to_graph(&data, axes, latent.layout), dtype)
            }
            &Source::Sigma { scale, per } => return Ok(Prepared::Sigma { scale, per, dtype }),
            &Source::Timestep { scale, per } => return Ok(Prepared::Timestep { scale, per, dtype }),
            &Source::Guidance { scale, per } => {
                let usual = if let Guidance::Embedded { scale } = self.velocity.guidance { scale } else { 0.0 };
                number(self.c.guidance.unwrap_or(usual) * scale, per, grid, false, dtype)?
            }
            &Source::Size { axis, scale, per } => {
                let size = [grid.frames, grid.height, grid.width].get(axis).copied().unwrap_or(0);
                number(size as f64 * scale, per, grid, false, dtype)?
            }
            Source::Indices { of } => indices(of, &self.manifest.chunk, grid.frames, self.c.padding, dtype),
            Source::Constant { shape, values } => {
                let n = shape.iter().product();
                let one = || vec![values.first().copied().unwrap_or(0.0); n];
                let data = if values.len() == n { values.clone() } else { one() };
                Array::from_f64(shape.clone(), &data, dtype)
            }
            Source::ConstantFile { file } => {
                let unread = || NetError::usage(format!("{file} of model {} was not read", self.manifest.name));
                let Plain { shape, data } = self.own.constants.get(i).and_then(Option::as_ref).ok_or_else(unread)?;
                Array::from_f64(shape.clone(), data, dtype)
            }
            Source::Embedding { key, optional_zeros } => match (self.embedding(key, branch), optional_zeros) {
                (Some(array), _) => Array::from_f64(array.shape.clone(), &array.data, dtype),
                (None, Some(shape)) => {
                    let zeros = vec![0.0; shape.iter().product()];
                    Array::from_f64(shape.clone(), &zeros, dtype)
                }
                (None, None) => {
                    let name = &self.manifest.name;
                    return Err(NetError::usage(format!(
                        "model {name} needs an embedding `{key}`, and no file has it"
                    )));
                }
            },
        };
        Ok(Prepared::Fixed(array))
    }

    /// The caller's array before the model's own; in the unconditional branch those of `negative` before both.
    fn embedding(&self, key: &str, branch: Branch) -> Option<&Plain> {
        let negative = [self.c.negative.as_ref(), self.own.negative];
        let negative = if branch == Branch::Unconditional { negative } else { [None; 2] };
        let places = negative.into_iter().chain([self.c.embeddings.as_ref(), self.own.embeddings]);
        places.flatten().find_map(|arrays| arrays.get(key))
    }
}

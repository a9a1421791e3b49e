//! The parts of latent-shaped inputs: mask, image, neighbours, and the place of z. Runs no network.

use super::{Branch, Conditioning, Own, is_dropped};
use crate::error::NetError;
use crate::manifest::{Axis, Direction, HistorySlots, ImageFill, LatentInput, Manifest, Part, VelocitySpec};
use crate::tensor::{Tensor, count};

/// What latent-shaped parts are made from.
pub(crate) struct Condition<'a> {
    velocity: &'a VelocitySpec,
    direction: Direction,
    /// Channels, latents in time, rows, columns of z.
    axes: [usize; 4],
    image: &'a Tensor,
    grey: Option<&'a Tensor>,
    history: Tensor,
}

/// Numbers, axes, and the places of z.
pub(super) type Joined = (Vec<f32>, [usize; 4], Vec<(usize, usize)>);

impl<'a> Condition<'a> {
    pub fn new(manifest: &'a Manifest, c: &'a Conditioning, own: &Own<'a>) -> Result<Self, NetError> {
        let told = |why: String| NetError::usage(format!("model {}: {why}", manifest.name));
        let velocity = manifest.velocity.as_ref().ok_or_else(|| told("has no velocity network".into()))?;
        let grid = c.grid;
        let axes = [manifest.latent.channels, grid.frames, grid.height, grid.width];
        if grid.is_empty() || count(&axes).is_none() {
            return Err(told(format!("latents of {axes:?} cannot be made")));
        }
        let [channels, _, h, w] = axes;
        if c.image.axes("the latent of the image")? != [channels, 1, h, w] {
            return Err(told(format!(
                "the latent of the image has shape {:?} and must have {:?}",
                c.image.shape,
                [channels, 1, h, w]
            )));
        }
        let given = c.history.as_ref().map(|h| h.axes("the history")).transpose()?;
        if let Some(axes) = given.filter(|&[c, _, rows, columns]| [c, rows, columns] != [channels, h, w]) {
            return Err(told(format!("the history has shape {axes:?} and must have [{channels}, n, {h}, {w}]")));
        }
        let image = manifest.chunk.history_includes_first.then_some(&c.image);
        let history = over_time(image.into_iter().chain(c.history.as_ref()), channels, h, w);
        if let Some(grey) = own.grey.filter(|g| g.shape != axes) {
            return Err(told(format!("the encoder gives {:?} for the image among grey, not {axes:?}", grey.shape)));
        }
        let direction = manifest.chunk.direction;
        Ok(Self { velocity, direction, axes, image: &c.image, grey: own.grey, history })
    }

    /// Joins the parts of an input.
    pub(super) fn join(&self, input: &LatentInput, branch: Branch) -> Result<Joined, NetError> {
        let [channels, _, h, w] = self.axes;
        let mut parts = Vec::new();
        let mut holes = Vec::new();
        let (mut channel, mut time) = (0, 0);
        for &part in &input.parts {
            let made = self.part(part, input, is_dropped(self.velocity, part, branch))?;
            if part == Part::Latents {
                holes.push((channel, time));
            }
            if input.over == Axis::Time {
                time += made.shape[1];
            } else {
                channel += made.shape[0];
            }
            parts.push(made);
        }
        if input.over == Axis::Time {
            let joined = over_time(parts.iter(), channels, h, w);
            return Ok((joined.data, [channels, time, h, w], holes));
        }
        // Channels lie one after the other.
        let time = parts.first().map_or(0, |p| p.shape[1]);
        Ok((parts.into_iter().flat_map(|p| p.data).collect(), [channel, time, h, w], holes))
    }

    fn part(&self, part: Part, input: &LatentInput, dropped: bool) -> Result<Tensor, NetError> {
        let [channels, frames, h, w] = self.axes;
        let mut made = match part {
            Part::Latents => return Tensor::filled(vec![channels, frames, h, w], 0.0),
            Part::Mask => {
                let mut mask = Tensor::filled(vec![input.mask_channels, frames, h, w], 0.0)?;
                mask.data.chunks_mut(frames * h * w).for_each(|c| c[..h * w].fill(1.0));
                mask
            }
            Part::First => self.image.clone(),
            Part::Image => match (input.image_fill, self.grey) {
                (ImageFill::EncodedGrey, Some(grey)) => grey.clone(),
                (ImageFill::EncodedGrey, None) => {
                    return Err(NetError::usage("the image among grey frames was not encoded"));
                }
                (ImageFill::Zeros, _) => {
                    let mut image = Tensor::filled(vec![channels, frames, h, w], 0.0)?;
                    let each = image.data.chunks_mut(frames * h * w).zip(self.image.data.chunks(h * w));
                    each.for_each(|(to, from)| to[..h * w].copy_from_slice(from));
                    image
                }
            },
            Part::History(slots) => of_history(&self.history, slots, self.direction, [channels, h, w])?,
        };
        if dropped {
            made.data.fill(0.0);
        }
        Ok(made)
    }
}

/// The neighbours of some slots in the order of time, zeros where there are none yet.
fn of_history(
    history: &Tensor,
    slots: HistorySlots,
    direction: Direction,
    [channels, h, w]: [usize; 3],
) -> Result<Tensor, NetError> {
    let there = history.shape.get(1).copied().unwrap_or(0);
    let mut made = Tensor::filled(vec![channels, slots.count, h, w], 0.0)?;
    for i in 0..slots.count {
        // Distance from the chunk of the i-th in the order of time, and where that neighbour is.
        let (distance, at) = match direction {
            Direction::Forward => {
                let distance = slots.nearest + slots.count - 1 - i;
                (distance, there.wrapping_sub(1 + distance))
            }
            Direction::Backward => (slots.nearest + i, slots.nearest + i),
        };
        if distance >= there {
            continue;
        }
        for c in 0..channels {
            let from = (c * there + at) * h * w;
            let to = (c * slots.count + i) * h * w;
            made.data[to..to + h * w].copy_from_slice(&history.data[from..from + h * w]);
        }
    }
    Ok(made)
}

/// Latents of the same size, one after the other in time.
fn over_time<'a>(parts: impl Iterator<Item = &'a Tensor>, channels: usize, h: usize, w: usize) -> Tensor {
    let parts: Vec<_> = parts.collect();
    let frames = parts.iter().map(|p| p.shape[1]).sum();
    let mut data = Vec::with_capacity(channels * frames * h * w);
    for c in 0..channels {
        for part in &parts {
            let block = part.shape[1] * h * w;
            data.extend_from_slice(&part.data[c * block..(c + 1) * block]);
        }
    }
    Tensor { shape: vec![channels, frames, h, w], data }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbours_are_found_by_distance_and_told_in_the_order_of_time() {
        // Two channels of three neighbours, 1 x 1.
        let history = Tensor::new(vec![2, 3, 1, 1], vec![1.0, 2.0, 3.0, 10.0, 20.0, 30.0]).unwrap();
        let of = |nearest, count, direction| {
            of_history(&history, HistorySlots { nearest, count }, direction, [2, 1, 1]).unwrap().data
        };
        assert_eq!(of(0, 1, Direction::Forward), [3.0, 30.0]);
        assert_eq!(of(1, 2, Direction::Forward), [1.0, 2.0, 10.0, 20.0]);
        assert_eq!(of(1, 3, Direction::Forward), [0.0, 1.0, 2.0, 0.0, 10.0, 20.0]);
        assert_eq!(of(0, 1, Direction::Backward), [1.0, 10.0]);
        assert_eq!(of(1, 3, Direction::Backward), [2.0, 3.0, 0.0, 20.0, 30.0, 0.0]);
        assert_eq!(of(7, 1, Direction::Backward), [0.0, 0.0]);
    }
}

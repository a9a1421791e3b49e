//! Everything a velocity network reads besides z and the noise level, made once for a chunk. Runs no network.

mod make;
mod parts;

use crate::array::Array;
use crate::embeddings::Embeddings;
use crate::error::NetError;
use crate::layout::{shape, to_graph};
use crate::manifest::{Dtype, Grid, Guidance, Layout, Manifest, Part, Per, VelocitySpec};
use crate::numbers::{clamped, number};
use crate::schedule::{Sigma, nearest, vp_table};
use crate::session::Feed;
use crate::tensor::Tensor;
use make::Maker;
use parts::Condition;

/// What a chunk is conditioned on.
#[derive(Debug, Clone)]
pub struct Conditioning {
    /// Size of z.
    pub grid: Grid,
    /// The latent of the image, [C, 1, h, w].
    pub image: Tensor,
    /// The image itself, [3, 1, H, W]; for networks that want it among grey frames.
    pub image_frame: Option<Tensor>,
    /// Neighbours made before, [C, n, h, w], in the order of time.
    pub history: Option<Tensor>,
    /// Latents between the image and a chunk that is made backward.
    pub padding: usize,
    /// In place of the manifest's scale.
    pub guidance: Option<f64>,
    /// In place of the manifest's arrays, key by key.
    pub embeddings: Option<Embeddings>,
    /// The same for the unconditional branch.
    pub negative: Option<Embeddings>,
}

impl Conditioning {
    /// A chunk conditioned on an image alone.
    pub fn on_image(grid: Grid, image: Tensor) -> Self {
        Self {
            grid,
            image,
            image_frame: None,
            history: None,
            padding: 0,
            guidance: None,
            embeddings: None,
            negative: None,
        }
    }
}

/// Which of the two evaluations of classifier-free guidance.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Branch {
    /// With the condition. The only one of other kinds of guidance.
    Conditional,
    /// Without.
    Unconditional,
}

/// A network input that can be read where it lies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direct<'a> {
    /// Channels of the whole tensor.
    pub channels: usize,
    /// What follows z in it.
    pub tail: &'a [f32],
}

/// A chunk's inputs, ready for any z and noise level.
#[derive(Debug, Clone)]
pub struct VelocityInputs {
    grid: Grid,
    channels: usize,
    cfg: Option<f64>,
    velocity: VelocitySpec,
    clamped: bool,
    table: Vec<f64>,
    conditional: Vec<Prepared>,
    unconditional: Vec<Prepared>,
    direct: Option<usize>,
}

/// An input, as far as it is known before z and the noise level.
#[derive(Debug, Clone)]
enum Prepared {
    Fixed(Array),
    Sigma { scale: f64, per: Per, dtype: Dtype },
    Timestep { scale: f64, per: Per, dtype: Dtype },
    Latents(WithHole),
}

/// A latent-shaped tensor in canonical order, with places for z.
#[derive(Debug, Clone)]
struct WithHole {
    data: Vec<f32>,
    axes: [usize; 4],
    /// First channel and first time of each place.
    holes: Vec<(usize, usize)>,
    layout: Layout,
    dtype: Dtype,
}

/// What a call gives: arrays made for it, and the name of each.
pub(crate) struct Filled<'a> {
    pub arrays: Vec<Option<Array>>,
    inputs: &'a VelocityInputs,
    prepared: &'a [Prepared],
    whole: Option<(usize, Vec<usize>, &'a [f32])>,
}

/// What the makers of inputs know of the model's own files.
pub(crate) struct Own<'a> {
    pub embeddings: Option<&'a Embeddings>,
    pub negative: Option<&'a Embeddings>,
    /// Of each input with a constant file, in the order of the inputs.
    pub constants: &'a [Option<crate::array::Plain>],
    /// Latents of the image among grey frames, where an input wants them.
    pub grey: Option<&'a Tensor>,
}

impl VelocityInputs {
    pub(crate) fn new(manifest: &Manifest, c: &Conditioning, own: &Own<'_>) -> Result<Self, NetError> {
        let velocity = manifest.velocity.as_ref();
        let velocity =
            velocity.ok_or_else(|| NetError::usage(format!("model {} has no velocity network", manifest.name)))?;
        let guidance = c.guidance.filter(|g| g.is_finite() && *g >= 0.0);
        if c.guidance.is_some() && guidance.is_none() {
            return Err(NetError::usage("guidance is a number that is not negative"));
        }
        // At scale 1 the unconditional branch cancels.
        let cfg = match velocity.guidance {
            Guidance::Cfg { scale, .. } => Some(guidance.unwrap_or(scale)).filter(|&scale| scale != 1.0),
            _ => None,
        };
        let maker = Maker { manifest, velocity, c, own, condition: Condition::new(manifest, c, own)? };
        let prepare = |branch: Branch| -> Result<Vec<Prepared>, NetError> {
            (0..velocity.inputs.len()).map(|i| maker.prepare(i, branch)).collect()
        };
        let conditional = prepare(Branch::Conditional)?;
        let unconditional = if cfg.is_some() { prepare(Branch::Unconditional)? } else { Vec::new() };
        let mut inputs = Self {
            grid: c.grid,
            channels: manifest.latent.channels,
            cfg,
            clamped: clamped(manifest.latent.first),
            table: vp_table(&velocity.schedule.kind),
            velocity: velocity.clone(),
            conditional,
            unconditional,
            direct: None,
        };
        inputs.direct = inputs.find_direct();
        Ok(inputs)
    }

    /// The input that can be read in place: the only one with z, which z begins, in the same order, type and scale.
    fn find_direct(&self) -> Option<usize> {
        let holds_z = |(i, p): (usize, &Prepared)| match p {
            Prepared::Latents(l) => Some((i, l.clone())),
            _ => None,
        };
        let mut with_z = self.conditional.iter().enumerate().filter_map(holds_z);
        let ((i, l), None) = (with_z.next()?, with_z.next()) else { return None };
        let in_place = l.layout == Layout::Bcthw
            && l.dtype == Dtype::F32
            && l.holes == [(0, 0)]
            && l.axes[1] == self.grid.frames
            && self.velocity.prediction.takes_z();
        let same = match self.unconditional.get(i) {
            Some(Prepared::Latents(other)) => other.data == l.data,
            _ => self.unconditional.is_empty(),
        };
        (in_place && same).then_some(i)
    }

    /// How the network can read its latent input where it lies: then `evaluate` may be given all of it, z first.
    pub fn direct(&self) -> Option<Direct<'_>> {
        match self.conditional.get(self.direct?)? {
            Prepared::Latents(l) => Some(Direct { channels: l.axes[0], tail: l.data.get(self.len()..)? }),
            _ => None,
        }
    }

    /// Size of z.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Numbers of z.
    pub fn len(&self) -> usize {
        self.channels * self.grid.len()
    }

    /// Whether z has no numbers.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Scale of classifier-free guidance, when two branches are needed: u + scale (c - u).
    pub fn cfg(&self) -> Option<f64> {
        self.cfg
    }

    /// How velocity follows from the network's answer at one noise level, held at the manifest's `least_sigma`.
    pub fn coefficients(&self, sigma: Sigma) -> crate::prediction::Coefficients {
        self.velocity.coefficients(sigma)
    }

    pub(crate) fn axes(&self) -> [usize; 4] {
        [self.channels, self.grid.frames, self.grid.height, self.grid.width]
    }

    /// Makes the arrays of one call. `latents` is z, or the whole of the direct input.
    pub(crate) fn fill<'a>(&'a self, latents: &'a [f32], sigma: Sigma, branch: Branch) -> Result<Filled<'a>, NetError> {
        let prepared = match branch {
            Branch::Conditional => &self.conditional,
            Branch::Unconditional if self.cfg.is_some() => &self.unconditional,
            Branch::Unconditional => return Err(NetError::usage("this guidance has no unconditional branch")),
        };
        let whole = self.direct.and_then(|i| match &prepared[i] {
            Prepared::Latents(l) if l.data.len() == latents.len() => Some((i, shape(l.axes, l.layout), latents)),
            _ => None,
        });
        if whole.is_none() && latents.len() != self.len() {
            let also = self.direct().map_or(String::new(), |d| format!(" or {}", self.len() + d.tail.len()));
            let (want, have) = (self.len(), latents.len());
            return Err(NetError::usage(format!("the network reads {want}{also} numbers of z, and is given {have}")));
        }
        let sigma = self.velocity.effective(sigma);
        let factor = self.velocity.prediction.coefficients(sigma).input;
        let mut arrays = Vec::with_capacity(prepared.len());
        for (i, prepared) in prepared.iter().enumerate() {
            arrays.push(match prepared {
                Prepared::Fixed(_) => None,
                Prepared::Latents(_) if whole.as_ref().is_some_and(|(at, ..)| *at == i) => None,
                Prepared::Latents(l) => Some(l.filled(latents, self.axes(), factor, self.clamped)),
                Prepared::Sigma { scale, per, dtype } => {
                    Some(number(sigma.value() * scale, *per, self.grid, self.clamped, *dtype)?)
                }
                Prepared::Timestep { scale, per, dtype } => {
                    let step = nearest(&self.table, sigma) as f64;
                    Some(number(step * scale, *per, self.grid, self.clamped, *dtype)?)
                }
            });
        }
        Ok(Filled { arrays, inputs: self, prepared, whole })
    }
}

impl Filled<'_> {
    /// Names and tensors for the network.
    pub fn feeds(&self) -> Vec<(&str, Feed<'_>)> {
        let mut feeds = Vec::with_capacity(self.prepared.len());
        for (i, (input, prepared)) in self.inputs.velocity.inputs.iter().zip(self.prepared).enumerate() {
            let feed = match (&self.whole, self.arrays.get(i).and_then(Option::as_ref), prepared) {
                (Some((at, shape, data)), ..) if *at == i => Feed::InPlace { shape, data },
                (_, Some(array), _) | (_, None, Prepared::Fixed(array)) => Feed::Array(array),
                // `fill` leaves nothing else open.
                _ => continue,
            };
            feeds.push((input.name.as_str(), feed));
        }
        feeds
    }
}

impl WithHole {
    /// The tensor with z, scaled, in its places.
    fn filled(&self, z: &[f32], axes: [usize; 4], factor: f64, clamped: bool) -> Array {
        let mut data = self.data.clone();
        let [channels, frames, h, w] = axes;
        for &(channel, time) in &self.holes {
            for c in 0..channels {
                let from = &z[c * frames * h * w..(c + 1) * frames * h * w];
                let at = ((channel + c) * self.axes[1] + time) * h * w;
                let to = &mut data[at..at + frames * h * w];
                // A latent held clean is at noise level 0, where the factor is 1.
                let clean = if clamped { h * w } else { 0 };
                to[..clean].copy_from_slice(&from[..clean]);
                for (to, from) in to[clean..].iter_mut().zip(&from[clean..]) {
                    *to = if factor == 1.0 { *from } else { (f64::from(*from) * factor) as f32 };
                }
            }
        }
        let shape = shape(self.axes, self.layout);
        match (self.layout, self.dtype) {
            (Layout::Bcthw, Dtype::F32) => Array { shape, numbers: crate::array::Numbers::F32(data) },
            _ => Array::from_f32(shape, &to_graph(&data, self.axes, self.layout), self.dtype),
        }
    }
}

/// Whether a part is zero in a branch.
fn is_dropped(velocity: &VelocitySpec, part: Part, branch: Branch) -> bool {
    branch == Branch::Unconditional
        && matches!(&velocity.guidance, Guidance::Cfg { drops, .. } if drops.contains(&part))
}

//! Frames to latents and back: layout, range of colours, scale of latents. Owns no file.

use std::sync::atomic::AtomicBool;

use crate::array::Array;
use crate::chain::Chain;
use crate::error::NetError;
use crate::layout::{from_graph, shape, to_graph};
use crate::library::Runtime;
use crate::manifest::{CodecSpec, Manifest, TensorSpec, latents_of};
use crate::session::Feed;
use crate::tensor::{Tensor, count};

/// What a codec's call needs to know.
pub(crate) struct Codec<'a> {
    pub runtime: &'a Runtime,
    pub manifest: &'a Manifest,
    pub spec: &'a CodecSpec,
    pub chain: &'a mut Chain,
}

impl Codec<'_> {
    /// [3, F, H, W] in 0..1 to [C, T, h, w].
    pub fn encode(&mut self, frames: &Tensor, cancel: &AtomicBool) -> Result<Tensor, NetError> {
        let axes @ [c, f, height, width] = frames.axes("the frames to encode")?;
        let latent = &self.manifest.latent;
        let told = |why: String| NetError::usage(format!("model {}: {why}", self.manifest.name));
        if c != 3 {
            return Err(told(format!("frames have 3 colours, not {c}")));
        }
        let t = latents_of(latent, f).map_err(told)?;
        let step = latent.spatial;
        if height == 0 || width == 0 || height % step != 0 || width % step != 0 {
            return Err(told(format!("frames of {width} x {height} pixels do not divide into latents of {step}")));
        }
        let mut colours = frames.data.clone();
        let (mean, std) = (&self.spec.colour_mean, &self.spec.colour_std);
        per_channel(&mut colours, mean.iter().zip(std).map(|(m, s)| (1.0 / s, -m / s)));
        let latents = [latent.channels, t, height / step, width / step];
        let mut data = self.run(colours, axes, latents, cancel)?;
        let (mean, std) = (&self.spec.latent_mean, &self.spec.latent_std);
        per_channel(&mut data, mean.iter().zip(std).map(|(m, s)| (1.0 / s, -m / s)));
        Ok(Tensor { shape: latents.to_vec(), data })
    }

    /// [C, T, h, w] to [3, F, H, W] in 0..1.
    pub fn decode(&mut self, latents: &Tensor, cancel: &AtomicBool) -> Result<Tensor, NetError> {
        let axes @ [c, t, h, w] = latents.axes("the latents to decode")?;
        let latent = &self.manifest.latent;
        if c != latent.channels || t == 0 || h == 0 || w == 0 {
            let want = format!("[{}, T, h, w]", latent.channels);
            let name = &self.manifest.name;
            return Err(NetError::usage(format!("model {name}: latents are {want}, not {:?}", latents.shape)));
        }
        let frames = [3, 1 + (t - 1) * latent.temporal, h * latent.spatial, w * latent.spatial];
        if count(&frames).is_none() {
            return Err(NetError::usage(format!("latents {:?} give more frames than memory can hold", latents.shape)));
        }
        let mut raw = latents.data.clone();
        let (mean, std) = (&self.spec.latent_mean, &self.spec.latent_std);
        per_channel(&mut raw, mean.iter().zip(std).map(|(m, s)| (*s, *m)));
        let mut data = self.run(raw, axes, frames, cancel)?;
        let (mean, std) = (&self.spec.colour_mean, &self.spec.colour_std);
        per_channel(&mut data, mean.iter().zip(std).map(|(m, s)| (*s, *m)));
        // NaN stays, so that it is seen.
        data.iter_mut().for_each(|v| *v = v.clamp(0.0, 1.0));
        Ok(Tensor { shape: frames.to_vec(), data })
    }

    fn run(
        &mut self,
        data: Vec<f32>,
        axes: [usize; 4],
        made: [usize; 4],
        cancel: &AtomicBool,
    ) -> Result<Vec<f32>, NetError> {
        let TensorSpec { name, layout, dtype } = &self.spec.input;
        let array = Array::from_f32(shape(axes, *layout), &to_graph(&data, axes, *layout), *dtype);
        let feeds = [(name.as_str(), Feed::Array(&array))];
        let mut out = Vec::new();
        let wanted = &self.spec.output;
        let shape = self.chain.run(self.runtime, &feeds, &wanted.name, &mut out, cancel)?;
        answer(self.manifest, wanted, shape, out, made)
    }
}

/// A graph's answer in canonical order, if it has the shape it must have.
pub(crate) fn answer(
    manifest: &Manifest,
    wanted: &TensorSpec,
    found: Vec<usize>,
    data: Vec<f32>,
    axes: [usize; 4],
) -> Result<Vec<f32>, NetError> {
    let expected = shape(axes, wanted.layout);
    if found != expected || count(&found) != Some(data.len()) {
        return Err(NetError::Contract {
            path: manifest.folder.clone(),
            tensor: wanted.name.clone(),
            why: format!("the network answers with {found:?} where the manifest means {expected:?}"),
        });
    }
    Ok(from_graph(data, axes, wanted.layout))
}

/// v = v scale + offset, for each channel of [C, …].
fn per_channel(data: &mut [f32], factors: impl ExactSizeIterator<Item = (f64, f64)>) {
    let block = (data.len() / factors.len().max(1)).max(1);
    for (channel, (scale, offset)) in data.chunks_mut(block).zip(factors) {
        if (scale, offset) != (1.0, 0.0) {
            channel.iter_mut().for_each(|v| *v = (f64::from(*v) * scale + offset) as f32);
        }
    }
}

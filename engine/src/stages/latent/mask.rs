//! Pixel masks of a clip as weights of latent cells. Knows neither networks nor what the masks mean.

use physvideo_gpu::kernels::{self, latent};
use physvideo_gpu::{Constants, Gpu, GpuError, Recording};

use crate::scene::Pool;

/// How pixels and frames become cells.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pooling {
    /// Size of a frame [px].
    pub size: (u32, u32),
    /// Frames.
    pub frames: u32,
    /// Pixels of a cell along x and y.
    pub spatial: u32,
    /// Frames of a latent after the first: latent 0 is frame 0, latent k covers frames t(k−1)+1 … tk.
    pub temporal: u32,
    /// When a cell belongs to the mask.
    pub pool: Pool,
    /// Cells by which the mask grows (`any`, `share`) or shrinks (`all`).
    pub reach: u32,
    /// Whether latent 0 is among the cells.
    pub first: bool,
}

impl Pooling {
    /// Latents along time.
    pub fn latents(&self) -> u32 {
        (self.frames.saturating_sub(1)).div_ceil(self.temporal) + u32::from(self.first)
    }
}

/// Most bytes of pixels on the device at once; more frames are pooled one stretch after another.
const MOST: u64 = 32 << 20;

/// Pools masks (a byte a pixel, 0 outside, frame after frame) into weights [T, h, w].
///
/// # Errors
/// Masks that do not fit, or the device's refusal.
pub fn pool(gpu: &Gpu, masks: &[u8], pooling: Pooling) -> Result<Vec<f32>, GpuError> {
    let Pooling { size: (width, height), frames, spatial, temporal, first, .. } = pooling;
    let frame = width as usize * height as usize;
    if masks.len() != frame * frames as usize || frame == 0 || frames == 0 || spatial == 0 || temporal == 0 {
        let message = format!("{} pixels of masks for {frames} frames of {width} × {height}", masks.len());
        return Err(GpuError::Call { kernel: "latent/mask_pool".into(), message });
    }
    let mut weights = Vec::new();
    if first {
        weights.extend(stretch(gpu, &masks[..frame], Pooling { frames: 1, ..pooling })?);
    }
    // Latents after the first look at frames of their own: a stretch of whole latents, with one frame before it that
    // only stands for frame 0.
    let latents = (MOST / (4 * frame as u64 * u64::from(temporal))).max(1) as usize;
    for part in masks[frame..].chunks(latents * temporal as usize * frame) {
        let with = [&masks[..frame], part].concat();
        let frames = (with.len() / frame) as u32;
        weights.extend(stretch(gpu, &with, Pooling { frames, first: false, ..pooling })?);
    }
    Ok(weights)
}

/// Device memory that pooling takes [bytes].
pub fn pooling_bytes(pooling: &Pooling) -> u64 {
    let frame = 4 * u64::from(pooling.size.0) * u64::from(pooling.size.1);
    let all = frame * u64::from(pooling.frames);
    all.min(MOST.max(frame * u64::from(pooling.temporal)) + frame)
}

fn stretch(gpu: &Gpu, masks: &[u8], pooling: Pooling) -> Result<Vec<f32>, GpuError> {
    let Pooling { size: (width, height), frames, spatial, temporal, reach, first, .. } = pooling;
    let across = |pixels: u32| u64::from(pixels.div_ceil(spatial));
    let cells = u64::from(pooling.latents()) * across(width) * across(height);
    let words: Vec<u32> = masks.iter().map(|m| if *m == 0 { 0 } else { 0xff00_0000 }).collect();
    let call = latent::MaskPool {
        layers: gpu.upload("mask", "mask/layers", &words)?,
        weights: gpu.alloc("mask", "mask/weights", cells)?,
        immediates: kernels::MaskPool { frames, width, height, spatial, temporal, reach, first: u32::from(first) },
    };
    let mode = match pooling.pool {
        Pool::All => 0.0,
        Pool::Any => 1.0,
        Pool::Share => 2.0,
    };
    let mut rec = Recording::new("pool masks");
    rec.section("pool masks");
    rec.each(&call, &Constants::none().with("MODE", mode), cells);
    gpu.run(&rec)?;
    let weights = gpu.read_range(call.weights, 0, cells)?;
    gpu.free_arena("mask");
    Ok(weights)
}

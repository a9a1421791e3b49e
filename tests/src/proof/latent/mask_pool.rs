//! Proof of `latent/mask_pool`: the least, the greatest or the mean of what a cell covers in space and time.

use physvideo_gpu::kernels::MaskPool;

use crate::proof::points::image;
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "latent/mask_pool",
    inputs,
    compare,
    tolerance: 3e-7,
    reason: "whole numbers, and one division in f32",
    unordered: &[],
    // Seed 1, which is timed, has cells of 8 × 8 pixels and four frames, looked at to the first pixel that decides.
    bytes: 4.0 * 256.0 + 4.0,
    flops: 256.0,
};

/// Rule, pixels along a cell, frames of a latent, reach, whether latent 0 is among the weights.
const VARIANTS: [(u32, u32, u32, u32, u32); 5] =
    [(0, 4, 4, 1, 1), (1, 8, 4, 0, 1), (2, 5, 3, 1, 0), (1, 3, 2, 2, 0), (0, 8, 1, 0, 1)];

/// Items are weights; pictures need not be whole numbers of cells, nor films of latents.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let (mode, spatial, temporal, reach, first) = VARIANTS[(ask.seed % 5) as usize];
    let latents = (1..=5).rev().find(|t| ask.items.is_multiple_of(*t)).unwrap_or(1);
    let [across, down] = image(ask.items / latents);
    let mut cut = |whole: u32, cell: u32| (whole * cell).saturating_sub(random.below(cell as usize) as u32);
    let later = latents as u32 - first;
    let frames = if later == 0 { 1 } else { 1 + cut(later, temporal) };
    let (width, height) = (cut(across, spatial), cut(down, spatial));
    let call = MaskPool { frames, width, height, spatial, temporal, reach, first };
    // Patches, so that some cells are covered whole and some not at all.
    let patch = spatial * (1 + 2 * reach);
    let words = (0..frames * height * width).map(|i| {
        let (x, y, t) = (i % width / patch, i / width % height / patch, i / (width * height) / (temporal + 1));
        let mut of_patch = Random::new(u64::from(x) << 40 ^ u64::from(y) << 20 ^ u64::from(t) ^ ask.seed << 50);
        let covered = match of_patch.below(4) {
            0 => false,
            1 => true,
            2 => random.chance(0.002),
            _ => random.chance(0.998),
        };
        // Colours do not count, and any alpha covers.
        random.bits() as u32 & 0xff_ffff | if covered { 1 << (24 + random.below(8)) } else { 0 }
    });
    Call::new(ask.items.div_ceil(64))
        .rows(1 + (ask.seed % 2) as u32)
        .constant("MODE", f64::from(mode))
        .immediates(&call)
        .with("layers", &words.collect::<Vec<u32>>())
        .with("weights", &vec![f32::NAN; ask.items])
        .with("mode", &[mode])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (layers, weights): (Vec<u32>, Vec<f32>) = (call.buffers.get("layers"), out.get("weights"));
    let p: MaskPool = bytemuck::pod_read_unaligned(&call.immediates);
    let mode: u32 = call.buffers.one("mode");
    let (across, down) = (p.width.div_ceil(p.spatial), p.height.div_ceil(p.spatial));
    // A pixel or frame belongs to the cells within reach of its own.
    let near = |at: u32, cell: u32| (at / p.spatial).abs_diff(cell) <= p.reach;
    let mut want = Vec::new();
    for i in 0..weights.len() as u32 {
        let (x, y, latent) = (i % across, i / across % down, i / (across * down) + 1 - p.first);
        let (mut covered, mut seen) = (0u32, 0u32);
        for frame in (0..p.frames).filter(|f| f.div_ceil(p.temporal) == latent) {
            for row in (0..p.height).filter(|r| near(*r, y)) {
                for column in (0..p.width).filter(|c| near(*c, x)) {
                    seen += 1;
                    covered += u32::from(layers[((frame * p.height + row) * p.width + column) as usize] >> 24 != 0);
                }
            }
        }
        let share = f64::from(covered) / f64::from(seen);
        want.push([share.floor(), share.ceil(), share][mode as usize]);
    }
    let scale = if mode == 2 { 1.0 } else { 0.0 };
    vec![Compared::near("weights", weights.into_iter().map(f64::from).collect(), want, scale)]
}

//! Proof of `points/bin_count`: how many points' bounding squares reach each tile.

use physvideo_gpu::kernels::Screen;

use super::{SIZE, each, lists, scenery, seen};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "points/bin_count",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers, and squares that f32 bounds exactly",
    unordered: &[],
    bytes: 24.0,
    flops: 20.0,
};

fn inputs(ask: Ask) -> Call {
    let tiles = (SIZE[0].div_ceil(8) * SIZE[1].div_ceil(8)) as usize;
    each(ask.items, ask)
        .immediates(&Screen { width: SIZE[0], height: SIZE[1], points: ask.items as u32 })
        .with("splats", &scenery::discs(ask, SIZE))
        .with("counts", &vec![0u32; tiles])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let tiles = lists(&seen(&call.buffers.get::<[f32; 4]>("splats")), SIZE);
    let want: Vec<u32> = tiles.iter().map(|t| t.len() as u32).collect();
    vec![Compared::equal("points of each tile", &out.get::<u32>("counts"), &want)]
}

//! Proof of `points/nearest32`: least depth of every pixel, then least number among the points of that depth.

use physvideo_gpu::kernels::Screen;

use super::{NOTHING, SIZE, each, nearest, scenery, seen};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "points/nearest32",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "depths are passed on, and f32 decides exactly what discs in multiples of 1/64 px hit",
    unordered: &[],
    bytes: 24.0,
    flops: 60.0,
};

/// Number and depth bits of every pixel.
fn keys(splats: &[[f32; 4]]) -> Vec<[u32; 2]> {
    let pixels = nearest(&seen(splats), SIZE, [0.0; 2]);
    pixels.iter().map(|p| if p.hit { [p.id, (p.depth as f32).to_bits()] } else { [NOTHING; 2] }).collect()
}

/// Odd seeds are the second pass, which finds what the first one leaves.
fn inputs(ask: Ask) -> Call {
    let splats = scenery::discs(ask, SIZE);
    let second = ask.seed % 2 == 1;
    let keys: Vec<[u32; 2]> = keys(&splats).iter().map(|k| [NOTHING, if second { k[1] } else { NOTHING }]).collect();
    each(ask.items, ask)
        .constant("NUMBERS", f64::from(u8::from(second)))
        .immediates(&Screen { width: SIZE[0], height: SIZE[1], points: ask.items as u32 })
        .with("splats", &splats)
        .with("keys", &keys)
        .with("second", &[u32::from(second)])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let second = call.buffers.one::<u32>("second") == 1;
    let want = keys(&call.buffers.get::<[f32; 4]>("splats"));
    let want: Vec<u32> = want.iter().flat_map(|k| [if second { k[0] } else { NOTHING }, k[1]]).collect();
    vec![Compared::equal("number and depth bits", &out.get::<u32>("keys"), &want)]
}

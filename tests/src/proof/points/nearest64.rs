//! Proof of `points/nearest64`: the nearest point of every pixel and its depth, from world points.

use physvideo_gpu::kernels::Screen;

use super::scenery::Scenery;
use super::{NOTHING, SIZE, each, nearest};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "points/nearest64",
    inputs,
    compare,
    tolerance: 1e-6,
    reason: "a depth is a sum of three products of coordinates below 4 m in f32",
    unordered: &[],
    bytes: 32.0,
    flops: 90.0,
};

fn inputs(ask: Ask) -> Call {
    let scenery = Scenery::new(ask, SIZE);
    each(ask.items, ask)
        .constant("RADIUS_IN_PIXELS", f64::from(u8::from(scenery.pixels)))
        .immediates(&Screen { width: SIZE[0], height: SIZE[1], points: ask.items as u32 })
        .with("points", &scenery.points)
        .with("camera", &[scenery.camera])
        .with("keys", &vec![u64::MAX; (SIZE[0] * SIZE[1]) as usize])
        .with("margin", &scenery.margin)
        .with("pixels", &[u32::from(scenery.pixels)])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let scenery = Scenery {
        points: input.get("points"),
        camera: input.one("camera"),
        pixels: input.one::<u32>("pixels") == 1,
        margin: input.one("margin"),
    };
    let pixels = nearest(&scenery.discs(), SIZE, scenery.margin);
    let keys: Vec<u64> = out.get("keys");
    let sure: Vec<_> = keys.iter().zip(&pixels).filter(|(_, p)| !p.unsure).collect();
    let got: Vec<u32> = sure.iter().map(|(k, _)| **k as u32).collect();
    let want: Vec<u32> = sure.iter().map(|(_, p)| if p.hit { p.id } else { NOTHING }).collect();
    let hits = sure.iter().filter(|(_, p)| p.hit);
    vec![
        Compared::fact("most pixels are decided", 10 * sure.len() > 9 * pixels.len()),
        Compared::equal("numbers", &got, &want),
        Compared::close(
            "depths",
            hits.clone().map(|(k, _)| f64::from(f32::from_bits((**k >> 32) as u32))).collect(),
            hits.clone().map(|(_, p)| p.depth).collect(),
            hits.map(|(_, p)| 4.0 + p.depth).collect(),
        ),
    ]
}

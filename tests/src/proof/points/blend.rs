//! Proof of `points/blend`: the K nearest points of every pixel, composited as PyTorch3D does, from lists of tiles.

use glam::DVec2;
use physvideo::scene::Compositing;
use physvideo_gpu::kernels::Room;

use super::{SIZE, channels, lists, scenery, seen, starts};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;
use crate::twins::points::{Pixel, Scene, pixel};

pub static CASE: Case = Case {
    kernel: "points/blend",
    // It broadcasts from eight lanes.
    inputs: |ask| inputs(ask).lanes(8),
    compare,
    tolerance: 0.501,
    reason: "bytes: rounding moves a channel by a half, and a dozen operations in f32 by 1e-6 of 255; what is hit and \
             what is nearest is exact with discs in multiples of 1/64 px",
    unordered: &[],
    bytes: 12.0,
    flops: 500.0,
};

/// Points blended, front to back, blend depth [m], depth wanted, objects wanted.
const VARIANTS: [(usize, bool, Option<f64>, bool, bool); 4] = [
    (8, false, None, false, false),
    (3, true, None, true, false),
    (5, false, Some(0.25), false, true),
    (8, true, Some(0.125), true, true),
];
const PIXELS: usize = (SIZE[0] * SIZE[1]) as usize;
const PAPER: u32 = 0x0102_0304;

/// Items are points. Every third seed has lists cut short, as before the host has made room.
pub(super) fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let splats = scenery::discs(ask, SIZE);
    let tiles = lists(&seen(&splats), SIZE);
    let counts: Vec<u32> = tiles.iter().map(|t| t.len() as u32).collect();
    let starts = starts(&counts);
    let mut list = vec![0; counts.iter().sum::<u32>() as usize];
    for (mut tile, start) in tiles.into_iter().zip(&starts) {
        random.shuffle(&mut tile);
        list[*start as usize..*start as usize + tile.len()].copy_from_slice(&tile);
    }
    if ask.seed % 3 == 2 {
        list.truncate(list.len() * 2 / 3);
    }
    let ends: Vec<u32> = starts.iter().zip(&counts).map(|(s, c)| s + c).collect();
    let variant = (ask.seed % 4) as usize;
    let (k, alpha, limit, depth, ids) = VARIANTS[variant];
    let mut words = || (0..ask.items).map(|_| random.bits() as u32).collect::<Vec<_>>();
    let mut call = Call::new(counts.len()).rows(1 + (ask.seed % 3) as u32);
    if let Some(limit) = limit {
        call = call.constant("BLEND_DEPTH", limit).constant("LEAST_WEIGHT", 1e-12);
    }
    call.constant("K", k as f64)
        .constant("ALPHA", f64::from(u8::from(alpha)))
        .constant("WANT_DEPTH", f64::from(u8::from(depth)))
        .constant("WANT_IDS", f64::from(u8::from(ids)))
        .immediates(&Room { width: SIZE[0], height: SIZE[1], points: ask.items as u32, room: list.len() as u32 })
        .with("splats", &splats)
        .with("counts", &counts)
        .with("ends", &ends)
        .with("list", &list)
        .with("colors", &words())
        .with("objects", &words())
        .with("image", &vec![PAPER; PIXELS])
        .with("depths", &vec![PAPER; if depth { PIXELS } else { 0 }])
        .with("ids", &vec![PAPER; if ids { PIXELS } else { 0 }])
        .with("variant", &[variant as u32])
}

/// The image of what the lists name, tile by tile.
fn twin(call: &Call) -> Vec<Pixel> {
    let input = &call.buffers;
    let all = seen(&input.get::<[f32; 4]>("splats"));
    let (counts, ends, list): (Vec<u32>, Vec<u32>, Vec<u32>) =
        (input.get("counts"), input.get("ends"), input.get("list"));
    let (colors, objects): (Vec<u32>, Vec<u32>) = (input.get("colors"), input.get("objects"));
    let (k, alpha, blend_depth, ..) = VARIANTS[input.one::<u32>("variant") as usize];
    let compositing = if alpha { Compositing::Alpha } else { Compositing::NormWeighted };
    let mut image = vec![Pixel { hit: false, rgb: glam::DVec3::ZERO, depth: 0.0, id: 0, unsure: true }; PIXELS];
    for (tile, (count, end)) in counts.iter().zip(&ends).enumerate() {
        let mut discs = vec![None; all.len()];
        for place in (end - count) as usize..(*end as usize).min(list.len()) {
            discs[list[place] as usize] = all[list[place] as usize];
        }
        let scene = Scene {
            discs: &discs,
            colors: &colors,
            objects: &objects,
            size: SIZE,
            k,
            compositing,
            blend_depth,
            margin: [0.0; 2],
            closed: false,
        };
        let across = SIZE[0].div_ceil(8);
        let (left, top) = (tile as u32 % across * 8, tile as u32 / across * 8);
        for y in top..SIZE[1].min(top + 8) {
            for x in left..SIZE[0].min(left + 8) {
                image[(y * SIZE[0] + x) as usize] = pixel(&scene, DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
            }
        }
    }
    image
}

pub(super) fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let image = twin(call);
    let (.., depth, ids) = VARIANTS[call.buffers.one::<u32>("variant") as usize];
    let (rgb, alphas) = channels(&out.get::<u32>("image"));
    let of = |wanted: bool, value: &dyn Fn(&Pixel) -> u32| -> Vec<u32> {
        image.iter().filter(|_| wanted).map(value).collect()
    };
    vec![
        Compared::near("colours", rgb, image.iter().flat_map(|p| p.rgb.to_array()).collect(), 1.0),
        Compared::equal("alphas", &alphas, &of(true, &|p| if p.hit { 255 } else { 0 })),
        Compared::equal("depth bits", &out.get::<u32>("depths"), &of(depth, &|p| (p.depth as f32).to_bits())),
        Compared::equal("objects", &out.get::<u32>("ids"), &of(ids, &|p| p.id)),
    ]
}

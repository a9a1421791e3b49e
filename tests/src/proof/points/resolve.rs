//! Proof of `points/resolve`: colour, depth and object of a pixel from the number of its nearest point.

use physvideo_gpu::kernels::Screen;

use super::scenery::Scenery;
use super::{NOTHING, channels, each, image, nearest};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "points/resolve",
    inputs,
    compare,
    tolerance: 0.55,
    reason: "bytes: rounding moves a channel by a half, and a weight 1 − d²/r² with r of half a pixel and more, places \
             known to 2e-5 px, is known to 2e-4 of 255",
    unordered: &[],
    bytes: 8.0 + 16.0 + 8.0 + 12.0,
    flops: 60.0,
};

/// Compositor, least weight, depth wanted, objects wanted.
const VARIANTS: [(bool, f64, bool, bool); 4] =
    [(false, 1e-4, false, false), (true, 1e-4, true, true), (false, 0.3, true, false), (false, 1e-12, false, true)];
const PAPER: u32 = 0x0102_0304;

/// Items are pixels, and as many points.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let [width, height] = image(ask.items);
    let scenery = Scenery::new(ask, [width, height]);
    let pixels = nearest(&scenery.discs(), [width, height], scenery.margin);
    // Where rounding decides what is nearest, nothing is.
    let keys: Vec<[u32; 2]> = pixels
        .iter()
        .map(|p| if p.hit && !p.unsure { [p.id, (p.depth as f32).to_bits()] } else { [NOTHING; 2] })
        .collect();
    let variant = (ask.seed % 4) as usize;
    let (alpha, least, depth, ids) = VARIANTS[variant];
    let mut words = || (0..ask.items).map(|_| random.bits() as u32).collect::<Vec<_>>();
    each(ask.items, ask)
        .constant("ALPHA", f64::from(u8::from(alpha)))
        .constant("LEAST_WEIGHT", least)
        .constant("WANT_DEPTH", f64::from(u8::from(depth)))
        .constant("WANT_IDS", f64::from(u8::from(ids)))
        .constant("RADIUS_IN_PIXELS", f64::from(u8::from(scenery.pixels)))
        .immediates(&Screen { width, height, points: ask.items as u32 })
        .with("keys", &keys)
        .with("points", &scenery.points)
        .with("camera", &[scenery.camera])
        .with("colors", &words())
        .with("objects", &words())
        .with("image", &vec![PAPER; ask.items])
        .with("depths", &vec![PAPER; if depth { ask.items } else { 0 }])
        .with("ids", &vec![PAPER; if ids { ask.items } else { 0 }])
        .with("variant", &[variant as u32, u32::from(scenery.pixels)])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let screen: Screen = bytemuck::pod_read_unaligned(&call.immediates);
    let variant: [u32; 2] = input.one("variant");
    let scenery =
        Scenery { points: input.get("points"), camera: input.one("camera"), pixels: variant[1] == 1, margin: [0.0; 2] };
    let discs = scenery.discs();
    let keys: Vec<[u32; 2]> = input.get("keys");
    let (colors, objects): (Vec<u32>, Vec<u32>) = (input.get("colors"), input.get("objects"));
    let (alpha, least, depth, ids) = VARIANTS[variant[0] as usize];
    let mut want = Vec::new();
    for (at, key) in keys.iter().enumerate() {
        let Some([x, y, _, r]) = discs.get(key[0] as usize).copied().flatten() else {
            want.extend([0.0; 3]);
            continue;
        };
        let (column, row) = (at as u32 % screen.width, at as u32 / screen.width);
        let d2 = (f64::from(column) + 0.5 - x).powi(2) + (f64::from(row) + 0.5 - y).powi(2);
        let w = 1.0 - d2 / (r * r);
        let share = if alpha { w } else { w / w.max(least) };
        want.extend([0, 8, 16].map(|s| share * f64::from((colors[key[0] as usize] >> s) & 0xff)));
    }
    let hit = |key: &[u32; 2]| key[0] != NOTHING;
    let (rgb, alphas) = channels(&out.get::<u32>("image"));
    let of = |wanted: bool, value: &dyn Fn(&[u32; 2]) -> u32| -> Vec<u32> {
        keys.iter().filter(|_| wanted).map(|k| if hit(k) { value(k) } else { 0 }).collect()
    };
    vec![
        Compared::near("colours", rgb, want, 1.0),
        Compared::equal("alphas", &alphas, &of(true, &|_| 255)),
        Compared::equal("depth bits", &out.get::<u32>("depths"), &of(depth, &|k| k[1])),
        Compared::equal("objects", &out.get::<u32>("ids"), &of(ids, &|k| objects[k[0] as usize])),
    ]
}

//! Proof of `points/compose`: (α c + (255 − α) b) / 255, rounded to the nearest byte.

use physvideo_gpu::kernels::Background;

use super::each;
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "points/compose",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers, and no sum lies halfway between two bytes because 255 is odd",
    unordered: &[],
    bytes: 12.0,
    flops: 12.0,
};

/// Items are pixels. Odd seeds have one colour behind the layer, and no picture.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let picture = ask.seed.is_multiple_of(2);
    let color = random.bits() as u32;
    let mut words = |alphas: [u32; 3]| -> Vec<u32> {
        let mut word = || (random.bits() as u32, alphas[random.below(3)]);
        (0..ask.items)
            .map(|_| word())
            .map(|(w, alpha)| if alpha == 1 { w } else { w & 0xff_ffff | alpha << 24 })
            .collect()
    };
    // Layers are mostly nothing or opaque; 1 stands for any alpha. Those of the background do not count.
    let (layer, background) = (words([0, 1, 255]), words([1, 1, 1]));
    each(ask.items, ask)
        .constant("PICTURE", f64::from(u8::from(picture)))
        .immediates(&Background { pixels: ask.items as u32, color })
        .with("layer", &layer)
        .with("background", if picture { &background[..] } else { &[] })
        .with("image", &vec![7u32; ask.items])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (layer, background): (Vec<u32>, Vec<u32>) = (call.buffers.get("layer"), call.buffers.get("background"));
    let given: Background = bytemuck::pod_read_unaligned(&call.immediates);
    let want = layer.iter().enumerate().map(|(i, over)| {
        let under = background.get(i).copied().unwrap_or(given.color);
        let alpha = f64::from(over >> 24) / 255.0;
        let channel = |shift: u32| {
            let [a, b] = [over, &under].map(|w| f64::from((w >> shift) & 0xff));
            ((alpha * a + (1.0 - alpha) * b).round() as u32) << shift
        };
        channel(0) | channel(8) | channel(16) | 0xff00_0000
    });
    vec![Compared::equal("pixels", &out.get::<u32>("image"), &want.collect::<Vec<_>>())]
}

//! Proof of `latent/mix`: M z + (1 − M) ((1 − σ) base + σ ε), with M the weight of the cell.

use physvideo_gpu::kernels::Mix;

use super::{Want, cells, compared, each, mask, normals, sum, values};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "latent/mix",
    inputs,
    compare,
    tolerance: 6e-7,
    reason: "a normal is known to 1e-6 in f32, where it is counted with 2 besides its size; the rest is a sum of a few \
             products",
    unordered: &[],
    bytes: 4.0 * 16.0,
    flops: 440.0,
};

fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let masked = ask.seed % 3 != 2;
    let cells = cells(ask);
    let (z, base) = (values(&mut random, ask, (ask.seed % 3) as usize * 4), values(&mut random, ask, 0));
    let mix = Mix {
        seed: [random.bits() as u32, random.bits() as u32],
        count: ask.items as u32 * 4,
        cells: cells as u32,
        iteration: ask.seed as u32,
        stream: random.bits() as u32,
        sigma: [28.0 / 29.0, 0.3, 1.0, 0.0][(ask.seed % 4) as usize],
        ..Default::default()
    };
    each(ask.items, ask)
        .constant("MASKED", f64::from(u8::from(masked)))
        .immediates(&mix)
        .with("z", &z)
        .with("base", &base)
        .with("mask", &if masked { mask(&mut random, cells) } else { Vec::new() })
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let [z, base, mask] = ["z", "base", "mask"].map(|name| call.buffers.get::<f32>(name));
    let given: Mix = bytemuck::pod_read_unaligned(&call.immediates);
    let sigma = f64::from(given.sigma);
    let mut want = Vec::new();
    for block in 0..given.count / 4 {
        let noise = normals(given.seed, given.stream, given.iteration, block);
        for (k, e) in noise.into_iter().enumerate() {
            let i = block as usize * 4 + k;
            let m = mask.get(i % given.cells as usize).map_or(0.0, |m| f64::from(*m));
            // What is kept or forgotten whole does not see the other side, whatever it is.
            let old = if m == 0.0 { 0.0 } else { m * f64::from(z[i]) };
            want.push(match sum(&[old, (1.0 - m) * (1.0 - sigma) * f64::from(base[i]), (1.0 - m) * sigma * e]) {
                Want::Value(value, scale) if m != 1.0 => Want::Value(value, scale + 2.0 * (1.0 - m) * sigma),
                _ => Want::Kept,
            });
        }
    }
    compared(&z, &out.get::<f32>("z"), &want)
}

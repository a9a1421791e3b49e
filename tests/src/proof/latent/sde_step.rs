//! Proof of `latent/sde_step`: z + d (a z + b v + m μ) + √d (s0 ε_n + s1 ε_{n+1}), with d the weight of the cell.

use physvideo_gpu::kernels::SdeStep;

use super::{Want, cells, compared, each, mask, normals, sum, values};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "latent/sde_step",
    inputs,
    compare,
    tolerance: 6e-7,
    reason: "a normal is known to 1e-6 in f32, where it is counted with 2 besides its size; the rest is a sum of a few \
             products",
    unordered: &[],
    // Latent both ways, velocity, weights.
    bytes: 4.0 * 16.0,
    // Ten rounds of Philox take 310, two logarithms, roots and turns 110, the sum 36.
    flops: 456.0,
};

/// Masked, anchored, ε_n, ε_{n+1}. The second is what Algorithm 1 runs, and what is timed.
const VARIANTS: [[bool; 4]; 6] = [
    [true, true, true, true],
    [true, false, true, false],
    [false, true, true, false],
    [true, true, false, false],
    [false, false, true, true],
    [false, false, false, false],
];

fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let flags = VARIANTS[(ask.seed % 6) as usize];
    let [masked, anchored, ..] = flags;
    let cells = cells(ask);
    let z = values(&mut random, ask, (ask.seed % 3) as usize * 4);
    let (v, mu) = (values(&mut random, ask, 0), values(&mut random, ask, 0));
    let step = SdeStep {
        seed: [random.bits() as u32, random.bits() as u32],
        count: ask.items as u32 * 4,
        cells: cells as u32,
        // The iteration after the last is the first again.
        iteration: if ask.seed == 4 { u32::MAX } else { ask.seed as u32 },
        stream: random.bits() as u32,
        a: -0.207,
        b: 0.0071,
        m: 0.093,
        s0: 0.632,
        s1: -0.316,
        ..Default::default()
    };
    ["MASKED", "ANCHORED", "NOISE", "TWO"]
        .into_iter()
        .zip(flags)
        .fold(each(ask.items, ask), |call, (name, flag)| call.constant(name, f64::from(u8::from(flag))))
        .immediates(&step)
        .with("z", &z)
        .with("v", &v)
        .with("mu", if anchored { &mu[..] } else { &[] })
        .with("update", &if masked { mask(&mut random, cells) } else { Vec::new() })
        .with("flags", &flags.map(u32::from))
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let [z, v, mu, update] = ["z", "v", "mu", "update"].map(|name| call.buffers.get::<f32>(name));
    let given: SdeStep = bytemuck::pod_read_unaligned(&call.immediates);
    let flags: [u32; 4] = call.buffers.one("flags");
    let [a, b, m, s0, s1] = [given.a, given.b, given.m, given.s0, given.s1].map(f64::from);
    let mut want = Vec::new();
    for block in 0..given.count / 4 {
        let noise = |iteration| normals(given.seed, given.stream, iteration, block);
        let (now, next) = (noise(given.iteration), noise(given.iteration.wrapping_add(1)));
        for k in 0..4 {
            let i = block as usize * 4 + k;
            let d = update.get(i % given.cells as usize).map_or(1.0, |d| f64::from(*d));
            if d == 0.0 {
                want.push(Want::Kept);
                continue;
            }
            let anchor = mu.get(i).map_or(0.0, |mu| f64::from(*mu));
            let drift = [a * f64::from(z[i]), b * f64::from(v[i]), m * anchor].map(|t| d * t);
            let [s, t] = [(flags[2], s0), (flags[3], s1)].map(|(made, s)| d.sqrt() * f64::from(made) * s);
            let Want::Value(value, scale) = sum(&[z[i].into(), drift[0], drift[1], drift[2], s * now[k], t * next[k]])
            else {
                continue;
            };
            want.push(Want::Value(value, scale + 2.0 * (s.abs() + t.abs())));
        }
    }
    compared(&z, &out.get::<f32>("z"), &want)
}

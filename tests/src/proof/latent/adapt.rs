//! Proof of `latent/adapt`: v = kp (u + g (c − u)) + kz z.

use physvideo_gpu::kernels::Adapt;

use super::{Want, compared, each, sum, values};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "latent/adapt",
    inputs,
    compare,
    tolerance: 3e-7,
    reason: "a sum of a few products in f32, relative to the sum of their sizes",
    unordered: &[],
    bytes: 4.0 * 16.0,
    flops: 6.0 * 4.0,
};

/// Prediction and latent by their shares, and guidance: x0 or ε−x0, VP-v, and both with guidance.
const VARIANTS: [(f32, f32, Option<f32>); 4] =
    [(-1.0, 0.0, None), (-1.0, 0.0, Some(6.5)), (0.62, -1.3, None), (1.37, -0.81, Some(1.5))];

/// Even seeds have a latent with more behind it.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let (kp, kz, guidance) = VARIANTS[(ask.seed % 4) as usize];
    let more = if ask.seed.is_multiple_of(2) { 24 } else { 0 };
    let z = values(&mut random, ask, more);
    let (mut conditional, mut other) = (values(&mut random, ask, more), values(&mut random, ask, 0));
    if ask.poison {
        // Finite before guidance, and not after.
        conditional.iter_mut().skip(5).step_by(31).for_each(|c| *c = 2e38);
        other.iter_mut().skip(5).step_by(31).for_each(|c| *c = -1.0);
    }
    let call = each(ask.items, ask)
        .constant("GUIDED", f64::from(u8::from(guidance.is_some())))
        .immediates(&Adapt { count: ask.items as u32 * 4, kp, kz, guidance: guidance.unwrap_or(0.0) })
        .with("z", &z)
        .with("conditional", &conditional)
        .with("velocity", &vec![7.0f32; ask.items * 4 + 8])
        .with("guided", &[u32::from(guidance.is_some())]);
    if guidance.is_some() { call.with("unconditional", &other) } else { call.same("unconditional", "conditional") }
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let given: Adapt = bytemuck::pod_read_unaligned(&call.immediates);
    let [kp, kz, g] = [given.kp, given.kz, given.guidance].map(f64::from);
    let (z, c): (Vec<f32>, Vec<f32>) = (input.get("z"), input.get("conditional"));
    let guided = input.one::<u32>("guided") == 1;
    let u: Vec<f32> = if guided { input.get("unconditional") } else { Vec::new() };
    let want: Vec<Want> = (0..given.count as usize)
        .map(|i| {
            let (z, c) = (f64::from(z[i]), f64::from(c[i]));
            if guided {
                let u = f64::from(u[i]);
                sum(&[kp * u, kp * g * c, -kp * g * u, kz * z])
            } else {
                sum(&[kp * c, kz * z])
            }
        })
        .collect();
    compared(&input.get::<f32>("velocity"), &out.get::<f32>("velocity"), &want)
}

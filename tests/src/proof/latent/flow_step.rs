//! Proof of `latent/flow_step`: z + a v + b w where it is free, else z.

use physvideo_gpu::kernels::FlowStep;

use super::{Want, cells, compared, each, mask, sum, values};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "latent/flow_step",
    inputs,
    compare,
    tolerance: 2e-7,
    reason: "a sum of three terms in f32, relative to the sum of their sizes",
    unordered: &[],
    bytes: 5.0 * 16.0,
    flops: 4.0 * 4.0,
};

/// Two velocities, held cells.
const VARIANTS: [(bool, bool); 4] = [(false, false), (true, true), (false, true), (true, false)];

fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let (two, held) = VARIANTS[(ask.seed % 4) as usize];
    let cells = cells(ask);
    let z = values(&mut random, ask, (ask.seed % 3) as usize * 4);
    let (v, w) = (values(&mut random, ask, 0), values(&mut random, ask, 0));
    each(ask.items, ask)
        .constant("TWO", f64::from(u8::from(two)))
        .constant("HELD", f64::from(u8::from(held)))
        .immediates(&FlowStep { count: ask.items as u32 * 4, cells: cells as u32, a: 0.13, b: -0.04 })
        .with("z", &z)
        .with("v", &v)
        .with("w", if two { &w[..] } else { &[] })
        .with("free", &if held { mask(&mut random, cells) } else { Vec::new() })
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let [z, v, w, free] = ["z", "v", "w", "free"].map(|name| call.buffers.get::<f32>(name));
    let given: FlowStep = bytemuck::pod_read_unaligned(&call.immediates);
    let want: Vec<Want> = (0..given.count as usize)
        .map(|i| {
            if free.get(i % given.cells as usize) == Some(&0.0) {
                return Want::Kept;
            }
            let second = w.get(i).map_or(0.0, |w| f64::from(given.b) * f64::from(*w));
            sum(&[z[i].into(), f64::from(given.a) * f64::from(v[i]), second])
        })
        .collect();
    compared(&z, &out.get::<f32>("z"), &want)
}

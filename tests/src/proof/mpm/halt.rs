//! Proof of `mpm/halt`: velocity and affine velocity are zero, all else keeps its bits.

use physvideo_gpu::kernels::{Clock, Particle};

use crate::proof::cloud::Cloud;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/halt",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "zeros and copies",
    unordered: &[],
    bytes: 96.0,
    flops: 0.0,
};

fn inputs(ask: Ask) -> Call {
    let clock = Clock { particles: ask.items as u32, ..Default::default() };
    Call::new(ask.items.div_ceil(64) + 1).with("particles", &Cloud::new(ask).particles).with("clock", &[clock])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let mut want: Vec<Particle> = call.buffers.get("particles");
    for p in &mut want {
        p.v = [0.0; 3];
        for row in [&mut p.c0, &mut p.c1, &mut p.c2] {
            row[..3].fill(0.0);
        }
    }
    let (got, want): (Vec<u32>, &[u32]) = (out.get("particles"), bytemuck::cast_slice(&want));
    vec![Compared::equal("particles", &got, want)]
}

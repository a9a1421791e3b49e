//! Proof of `mpm/prestress`: the stress carried under a share of the load, scaled to the whole of it.

use physvideo_gpu::kernels::{Clock, Particle, Prestress};

use crate::proof::cloud::Cloud;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/prestress",
    inputs,
    compare,
    tolerance: 3e-7,
    reason: "a division and a product in f32, 6e-8 each, relative to the stress",
    unordered: &[],
    bytes: 128.0,
    flops: 7.0,
};

fn inputs(ask: Ask) -> Call {
    let clock = Clock { particles: ask.items as u32, load: 0.07 + ask.seed as f32 * 0.01, ..Default::default() };
    Call::new(ask.items.div_ceil(64) + 1)
        .with("particles", &Cloud::new(ask).particles)
        .with("prestress", &vec![Prestress { a: [f32::NAN; 4], b: [f32::NAN; 4] }; ask.items])
        .with("clock", &[clock])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let load = f64::from(call.buffers.one::<Clock>("clock").load);
    let mut want = Vec::new();
    for p in call.buffers.get::<Particle>("particles") {
        let s = [p.c0[3], p.c1[3], p.c2[3], 0.0, p.s[0], p.s[1], p.s[2], 0.0];
        want.extend(s.map(|s| f64::from(s) / load));
    }
    let got = out.get::<f32>("prestress").into_iter().map(f64::from).collect();
    let scale = want.iter().map(|w| w.abs()).collect();
    vec![Compared::close("prestress", got, want, scale)]
}

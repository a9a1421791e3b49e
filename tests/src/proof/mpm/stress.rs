//! Proof of `mpm/stress`: V0 τ(F) of the material.

use physvideo_gpu::kernels::{Body, Clock, Deformation, Particle};

use super::{Mat3, bodies, gradient, law, memory, stress};
use crate::proof::cloud::Cloud;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/stress",
    inputs,
    compare,
    tolerance: 2e-6,
    reason: "ten Newton steps of the polar decomposition and a few products, relative to the size of the terms",
    unordered: &[],
    bytes: 240.0,
    flops: 300.0,
};

fn inputs(ask: Ask) -> Call {
    let cloud = Cloud::new(ask).quarantined();
    let clock = Clock { particles: ask.items as u32, ..Default::default() };
    Call::new(ask.items.div_ceil(64) + 1)
        .with("particles", &cloud.particles)
        .with("deformations", &cloud.deformations)
        .with("bodies", &bodies())
        .with("clock", &[clock])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (was, now): (Vec<Particle>, Vec<Particle>) = (input.get("particles"), out.get("particles"));
    let (deformations, bodies): (Vec<Deformation>, Vec<Body>) = (input.get("deformations"), input.get("bodies"));
    let (mut got, mut want, mut scale, mut kept) = (Vec::new(), Vec::new(), Vec::new(), true);
    for (i, (p, q)) in was.iter().zip(&now).enumerate() {
        let carried = |p: &Particle| [p.x, p.v, [p.m, p.c0[0], p.c1[1]]].map(|v| v.map(f32::to_bits));
        kept &= carried(p) == carried(q) && p.tag == q.tag;
        let (d, body) = (&deformations[i], &bodies[(p.tag & 0xff) as usize]);
        let (f, volume) = (gradient(d), f64::from(d.f0[3]));
        if !f.iter().all(|c| c.is_finite()) {
            continue; // of a particle in quarantine, whose stress nobody reads
        }
        let answer = law::respond(body, &f, memory(d), &Mat3::zeros());
        let tau = volume * answer.tau;
        let size = volume * law::stiffness(body, &f, &answer);
        got.extend(stress(q).iter());
        want.extend(tau.iter());
        scale.extend([size; 9]);
    }
    vec![Compared::close("V0 τ", got, want, scale), Compared::fact("all else keeps its bits", kept)]
}

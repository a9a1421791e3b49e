//! Proof of `mpm/survey`: least and greatest coordinates and the largest speed of each body, exactly.

use physvideo_gpu::kernels::{Asked, Extent, Particle};

use super::vec3;
use crate::proof::cloud::{ASLEEP, Cloud, QUARANTINED, body_count};
use crate::proof::lattice::{awake, busy};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/survey",
    inputs,
    compare,
    tolerance: 2e-7,
    reason: "a root of a sum of squares, rounded a few times; places are exact",
    unordered: &[],
    bytes: 32.0,
    flops: 6.0,
};

/// Even seeds have bodies one after another, as solvers have them; odd ones mixed.
fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask).quarantined();
    if ask.seed.is_multiple_of(2) {
        let each = ask.items.div_ceil(body_count()).max(1);
        for (i, p) in cloud.particles.iter_mut().enumerate() {
            p.tag = (p.tag & !0xff) | (i / each) as u32;
        }
    }
    let awake = awake(ask.items, ask.seed);
    Call::new(awake.len())
        .immediates(&Asked { count: ask.items as u32 })
        .with("particles", &cloud.particles)
        .with("extents", &vec![Extent::default(); body_count()])
        .with("awake", &awake)
}

/// The number that a key stands for: the bits of floats, so changed that they order like them.
fn number(key: u32) -> f64 {
    f64::from(f32::from_bits(if key >= 1 << 31 { key - (1 << 31) } else { !key }))
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (particles, awake): (Vec<Particle>, Vec<u32>) = (call.buffers.get("particles"), call.buffers.get("awake"));
    let (mut got, mut want, mut seen) = (Vec::new(), Vec::new(), Vec::new());
    let extents: Vec<Extent> = out.get("extents");
    for (body, e) in extents.iter().enumerate() {
        let its = particles.iter().enumerate().filter(|(i, p)| {
            (p.tag & 0xff) as usize == body && p.tag & (QUARANTINED | ASLEEP) == 0 && busy(&awake, *i)
        });
        let its: Vec<_> = its.map(|(_, p)| (vec3(&p.x), vec3(&p.v).norm())).collect();
        seen.push(u32::from(!its.is_empty()));
        if its.is_empty() {
            continue;
        }
        for a in 0..3 {
            got.extend([-number(e.low[a]), number(e.high[a])]);
            want.push(its.iter().map(|i| i.0[a]).fold(f64::INFINITY, f64::min));
            want.push(its.iter().map(|i| i.0[a]).fold(f64::NEG_INFINITY, f64::max));
        }
        got.push(f64::from(f32::from_bits(e.speed)));
        want.push(its.iter().map(|i| i.1).fold(0.0, f64::max));
    }
    vec![
        Compared::equal("bodies seen", &extents.iter().map(|e| e.seen).collect::<Vec<_>>(), &seen),
        Compared::near("extent and speed", got, want, 1.0),
    ]
}

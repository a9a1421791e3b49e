//! Proof of `points/carry`: x = Σ w (x_p + F_p F_p0⁻¹ (X − X_p0)) / Σ w, and points that stay put exactly.

use glam::{DMat3, DVec3};
use physvideo_gpu::kernels::{Bound, Carried, Carrier, Deformation, Particle};

use super::{bind, each};
use crate::proof::cloud::{Cloud, FLOWS, QUARANTINED};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;
use crate::twins::points as twin;

pub static CASE: Case = Case {
    kernel: "points/carry",
    inputs,
    compare,
    tolerance: 2e-7,
    reason: "a mean of four sums of a dozen products in f32, relative to the lengths in them",
    unordered: &[],
    bytes: 16.0 + 32.0 + 4.0 * (16.0 + 48.0 + 64.0) + 16.0,
    flops: 4.0 * 50.0,
};

/// Items are points; there are a third as many particles, and a third of these never moved.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed ^ 0xca44);
    let count = ask.items / 3 + 1;
    let mut now = Cloud::new(Ask { items: count, ..ask }).quarantined();
    let then = Cloud::new(Ask { items: count, seed: ask.seed + 100, poison: false });
    let still = Deformation { f0: [1.0, 0.0, 0.0, 1e-5], f1: [0.0, 1.0, 0.0, 0.0], f2: [0.0, 0.0, 1.0, 0.0] };
    let mut bound = Vec::new();
    for (i, (p, d)) in then.particles.iter().zip(&then.deformations).enumerate() {
        let unmoved = i % 3 == 0 && now.particles[i].tag & QUARANTINED == 0;
        if unmoved {
            now.deformations[i] = still;
        }
        let back = if unmoved { DMat3::IDENTITY } else { bind::gradient(d).inverse() }.transpose();
        let row = |r: DVec3| [r.x as f32, r.y as f32, r.z as f32, 0.0];
        let [x, y, z] = if unmoved { now.particles[i].x } else { p.x };
        bound.push(Bound { x: [x, y, z, 0.0], i0: row(back.x_axis), i1: row(back.y_axis), i2: row(back.z_axis) });
    }
    let (mut rest, mut carriers) = (Vec::new(), Vec::new());
    for _ in 0..ask.items {
        let first = random.below(count);
        let offset = random.vector(0.1);
        rest.push(std::array::from_fn::<f32, 4, _>(
            |axis| {
                if axis == 3 { 0.01 } else { bound[first].x[axis] + offset[axis] }
            },
        ));
        // None at all, or one to four, in any place; an empty place names no particle.
        let share = if random.chance(0.1) { 0.0 } else { 0.7 };
        let alone = random.chance(0.4);
        let mut carrier = Carrier { particle: [u32::MAX; 4], weight: [0.0; 4] };
        for k in 0..4 {
            if random.chance(share) {
                carrier.particle[k] = if alone { first } else { random.below(count) } as u32;
                carrier.weight[k] = random.range(0.1, 1.0);
            }
        }
        carriers.push(carrier);
    }
    each(ask.items, ask)
        .immediates(&Carried { count: ask.items as u32 })
        .with("rest", &rest)
        .with("carriers", &carriers)
        .with("particles", &now.particles)
        .with("deformations", &now.deformations)
        .with("bound", &bound)
        .with("points", &vec![[f32::NAN; 4]; ask.items])
}

fn vec(v: &[f32]) -> DVec3 {
    DVec3::new(v[0].into(), v[1].into(), v[2].into())
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (rest, points): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (call.buffers.get("rest"), out.get("points"));
    let (particles, deformations): (Vec<Particle>, Vec<Deformation>) =
        (call.buffers.get("particles"), call.buffers.get("deformations"));
    let (carriers, bound): (Vec<Carrier>, Vec<Bound>) = (call.buffers.get("carriers"), call.buffers.get("bound"));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    for ((point, start), carrier) in points.iter().zip(&rest).zip(&carriers) {
        let at = vec(start);
        let (mut sound, mut still, mut size) = (Vec::new(), true, 0.0f64);
        let used: Vec<usize> = (0..4).filter(|k| carrier.weight[*k] > 0.0).collect();
        for k in &used {
            let i = carrier.particle[*k] as usize;
            if particles[i].tag & QUARANTINED != 0 {
                continue;
            }
            let b = &bound[i];
            let f0 = DMat3::from_cols(vec(&b.i0), vec(&b.i1), vec(&b.i2)).transpose().inverse();
            // What flows has no F to follow: its points move as it does.
            let flows = particles[i].tag & FLOWS != 0;
            let f = if flows { f0 } else { bind::gradient(&deformations[i]) };
            let p = twin::Particle { x0: vec(&b.x), x: vec(&particles[i].x), f0, f };
            still &= p.x == p.x0 && p.f == DMat3::IDENTITY && f0 == DMat3::IDENTITY;
            size = size.max(at.length() + p.x.length() + 20.0 * (at - p.x0).length());
            sound.push((p, f64::from(carrier.weight[*k])));
        }
        let moved = if still { at } else { twin::carry(at, &sound) };
        let radius = if sound.is_empty() && !used.is_empty() { 0.0 } else { f64::from(start[3]) };
        got.extend(point.map(f64::from));
        want.extend([moved.x, moved.y, moved.z, radius]);
        let size = if still { 0.0 } else { size };
        scale.extend([size, size, size, 0.0]);
    }
    vec![Compared::close("points", got, want, scale)]
}

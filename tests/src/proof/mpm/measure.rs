//! Proof of `mpm/measure`: mass, momentum, angular momentum and energies of one body or of all, in partial sums of 64.

use physvideo_gpu::kernels::family::material::COROTATED;
use physvideo_gpu::kernels::{Body, Deformation, Only, Particle, Sums};

use super::{Mat3, affine, bodies, gradient, law, memory, vec3};
use crate::proof::cloud::{Cloud, DORMANT, QUARANTINED};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

/// Names all bodies.
const EVERY: u32 = u32::MAX;

pub static CASE: Case = Case {
    kernel: "mpm/measure",
    inputs,
    compare,
    tolerance: 1e-6,
    reason: "sums of at most 64 terms of either sign in f32, relative to the sum of their sizes; the energy adds the \
             polar decomposition",
    unordered: &[],
    bytes: 144.0,
    flops: 250.0,
};

fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask).quarantined();
    for p in cloud.particles.iter_mut().skip(5).step_by(9) {
        p.tag |= DORMANT | QUARANTINED;
    }
    // Some of what has more than its volume term when it is crushed is crushed.
    let crushed = |p: &Particle| bodies()[(p.tag & 0xff) as usize].material == COROTATED;
    let all = cloud.particles.iter().zip(&mut cloud.deformations).zip(0..);
    for ((_, d), i) in all.filter(|((p, _), i)| i % 2 == 1 && crushed(p)) {
        let by = [0.6, 0.45, 0.35][i / 2 % 3];
        [&mut d.f0, &mut d.f1, &mut d.f2].into_iter().for_each(|f| f[..3].iter_mut().for_each(|c| *c *= by));
    }
    let groups = ask.items.div_ceil(64);
    let body = match ask.seed % 4 {
        3 => EVERY,
        seed => (seed as usize % bodies().len()) as u32,
    };
    Call::new(groups)
        .immediates(&Only { body, count: ask.items as u32 })
        .with("particles", &cloud.particles)
        .with("deformations", &cloud.deformations)
        .with("bodies", &bodies())
        .with("sums", &vec![Sums { lost: f32::NAN, ..Default::default() }; groups])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (particles, deformations): (Vec<Particle>, Vec<Deformation>) =
        (call.buffers.get("particles"), call.buffers.get("deformations"));
    let bodies: Vec<Body> = call.buffers.get("bodies");
    let only: Only = bytemuck::pod_read_unaligned(&call.immediates);
    let sums: Vec<Sums> = out.get("sums");
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    for (group, s) in sums.iter().enumerate() {
        let numbers =
            [&s.momentum[..], &s.spin, &[s.elastic, s.height, s.lost, s.speed, s.potential, s.affine]].concat();
        got.extend(numbers.into_iter().map(f64::from));
        let (mut sum, mut size) = ([0.0; 14], [0.0; 14]);
        let all = particles.iter().zip(&deformations).skip(group * 64).take(64);
        for (p, d) in all.filter(|(p, _)| only.body == EVERY || p.tag & 0xff == only.body) {
            if p.tag & QUARANTINED != 0 {
                sum[10] += f64::from(u8::from(p.tag & DORMANT == 0));
                continue;
            }
            let (m, x, v) = (f64::from(p.m), vec3(&p.x), vec3(&p.v));
            let spin = m * x.cross(&v);
            let volume = f64::from(d.f0[3]);
            let body = &bodies[(p.tag & 0xff) as usize];
            let answer = law::respond(body, &gradient(d), memory(d), &Mat3::zeros());
            let energy = volume * answer.energy;
            let terms = [
                m * v[0],
                m * v[1],
                m * v[2],
                m,
                spin[0],
                spin[1],
                spin[2],
                0.5 * m * v.norm_squared(),
                energy,
                m * x[2],
                0.0,
                0.0,
                -m * vec3(&body.gravity).dot(&x),
                0.5 * m * affine(p).norm_squared(),
            ];
            let stiff = volume * law::stiffness(body, &gradient(d), &answer);
            for (i, term) in terms.iter().enumerate() {
                sum[i] += term;
                size[i] += match i {
                    0..=2 => m * v.norm(),
                    4..=6 => m * v.norm() * x.norm(),
                    8 => stiff,
                    12 => m * vec3(&body.gravity).norm() * x.norm(),
                    _ => term.abs(),
                };
            }
            sum[11] = f64::max(sum[11], v.norm());
            size[11] = sum[11];
        }
        want.extend(sum);
        scale.extend(size);
    }
    vec![Compared::close("sums of each workgroup", got, want, scale)]
}

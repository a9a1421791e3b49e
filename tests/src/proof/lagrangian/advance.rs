//! Proof of `lagrangian/advance`: each node sums the shares of the cells around it; those behind a clamp mirror another.

use std::collections::BTreeMap;

use physvideo_gpu::kernels::{Body, Clock, ElasticNode, Forces, Solid};

use super::{Bodies, DX, HELD, NOBODY, around, moved, solids};
use crate::proof::mpm::{Vec3, force, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/advance",
    inputs,
    compare,
    tolerance: 1e-6,
    reason: "sums of 27 shares in f32 and the fields' smoothsteps and exponentials, relative to the size of the terms",
    unordered: &[],
    bytes: 560.0,
    flops: 150.0,
};

fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mirrored = ask.seed % 2 == 1;
    if !mirrored {
        b.nodes.iter_mut().for_each(|n| n.mirror = NOBODY);
    }
    let mut random = Random::new(ask.seed ^ 0xad);
    let mut shares: Vec<[f32; 4]> = (0..27 * b.cells.len())
        .map(|_| {
            let [x, y, z] = random.vector(0.5);
            [x, y, z, f32::NAN]
        })
        .collect();
    if ask.poison {
        for i in (5..shares.len()).step_by(97) {
            shares[i][i % 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][i / 97 % 3];
        }
    }
    let dt = if ask.seed % 4 == 3 { 0.0 } else { 7e-4 };
    // A speed limit of 0.5 m/s where the step is forced.
    let (dx, force_dt) = (0.5 / 0.9 * 7e-4, if ask.seed % 4 >= 2 { 7e-4 } else { 0.0 });
    let clock = Clock { frame_start: 0.9, t: 0.1, dt, dx, force_dt, ..Default::default() };
    Call::new(b.nodes.len().div_ceil(64) + 1)
        .constant("MIRRORED", f64::from(u8::from(mirrored)))
        .constant("MEETS", (ask.seed % 2) as f64)
        .with("meets", &[(ask.seed % 2) as u32])
        .immediates(&b.sizes)
        .with("nodes", &b.nodes)
        .with("solids", &solids())
        .with("shares", &shares)
        .with("forces", &[force::forces()])
        .with("u", &b.u)
        .with("v", &b.v)
        .same("u_was", "u")
        .same("v_was", "v")
        .with("clock", &[clock])
        .with("cell_at", &b.cell_at)
        .with("node_at", &b.node_at)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (nodes, solids): (Vec<ElasticNode>, Vec<Solid>) = (input.get("nodes"), input.get("solids"));
    let shares: Vec<[f32; 4]> = input.get("shares");
    let forces: Forces = input.one("forces");
    let (u, v): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("v"));
    let (now_u, now_v): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (out.get("u"), out.get("v"));
    let (was, clock): (Clock, Clock) = (input.one("clock"), out.one("clock"));
    let (cell_at, node_at): (Vec<[i32; 3]>, Vec<[i32; 3]>) = (input.get("cell_at"), input.get("node_at"));
    let node_of: BTreeMap<[i32; 3], usize> = node_at.iter().zip(0..).map(|(p, i)| (*p, i)).collect();
    // Scattered from the cells, where the kernel gathers.
    let mut sums = vec![Vec3::zeros(); nodes.len()];
    for (c, at) in cell_at.iter().enumerate() {
        for (slot, s) in around().into_iter().enumerate() {
            sums[node_of[&moved(*at, s)]] += vec3(&shares[slot * cell_at.len() + c]);
        }
    }
    let dt = f64::from(was.dt);
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut lost, mut kept, mut fastest) = (0, true, 0.0f64);
    let (mut limited, mut perhaps) = (0, 0);
    let mut images = vec![false; nodes.len()];
    nodes.iter().filter(|n| n.mirror != NOBODY).for_each(|n| images[n.mirror as usize] = true);
    for (i, node) in nodes.iter().enumerate() {
        if node.tag & HELD != 0 {
            kept &= images[i] || (now_u[i] == u[i] && now_v[i] == v[i]);
            continue;
        }
        let mirror = (node.mirror != NOBODY).then_some(node.mirror as usize);
        let f = sums[i] - mirror.map_or(Vec3::zeros(), |m| sums[m]);
        let (x, speed) = (vec3(&node.x) + vec3(&u[i]), vec3(&v[i]));
        let solid = &solids[(node.tag & 0xff) as usize];
        let body = Body { fields: solid.fields, gravity: solid.gravity, ..Default::default() };
        let (a, close) = force::acceleration(&forces, &body, x, speed, 1.0);
        let m = f64::from(node.m);
        let kick = 0.5 * (f64::from(v[i][3]) + dt);
        let next = speed + kick * (f / m + a);
        let bad = !next.iter().all(|c| c.is_finite());
        lost += u32::from(bad);
        if close {
            perhaps += 1;
            continue;
        }
        let mut next = if bad { Vec3::zeros() } else { next };
        // Light nodes at a rim do not count.
        let heavy = m > 0.03 * f64::from(solid.density) * DX.powi(3);
        if input.one::<u32>("meets") == 1 && heavy && next.norm() > 0.25 * f64::from(solid.wave) {
            fastest = fastest.max(f64::from(was.wave_speed.max(solid.wave)) + next.norm());
        }
        let most = 0.9 * f64::from(was.dx) / dt.max(f64::from(v[i][3]));
        if was.force_dt > 0.0 {
            limited += u32::from(next.norm() > most * (1.0 + 1e-5));
            perhaps += u32::from(next.norm() > most * (1.0 - 1e-5));
            next *= (most / next.norm()).min(1.0);
        }
        let place = vec3(&u[i]) + dt * next;
        // 27 shares of up to 0.5 N, fields of up to 1000 m/s².
        let size = 1.0 + kick * (27.0 / m + 1e3);
        let mut add = |g: &[f32; 4], w: Vec3, size: f64| {
            got.extend(vec3(g).iter());
            want.extend(w.iter());
            scale.extend([size; 3]);
        };
        add(&now_v[i], next, size);
        add(&now_u[i], place, 0.1 + dt * size);
        if let Some(m) = mirror {
            add(&now_v[m], -next, size);
            add(&now_u[m], -place, 0.1 + dt * size);
        }
        kept &= now_v[i][3] == was.dt;
    }
    vec![
        Compared::close("place and velocity", got, want, scale),
        Compared::fact("what is fast shortens the next step", {
            let told = f64::from(f32::from_bits(clock.speed_bits));
            perhaps > 0 || (told - fastest).abs() <= 2e-5 * (fastest + 1.0)
        }),
        Compared::equal("lost", &[clock.quarantined], &[lost]),
        Compared::fact("those slowed down are counted", (limited..=perhaps).contains(&clock.clamped_velocity)),
        Compared::fact("what is held stays, and the step is remembered", kept),
    ]
}

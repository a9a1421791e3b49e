//! Proof of `mpm/settle`: the flags of each particle are those of its block, and what falls asleep stands still.

use physvideo_gpu::kernels::{Grid, Particle};

use crate::proof::cloud::{ASLEEP, Cloud, QUARANTINED, WATCHED, grid};
use crate::proof::lattice::{NOWHERE, key};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/settle",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers and zeroes; inputs keep clear of cell borders, where rounding decides",
    unordered: &[],
    bytes: 200.0,
    flops: 3.0,
};

fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask).quarantined();
    // A place that is not finite, of a particle nobody has noticed yet.
    if let Some(p) = cloud.particles.get_mut(40).filter(|_| ask.poison) {
        (p.tag, p.x) = (1, [f32::NAN, 0.3, 0.2]);
    }
    for p in cloud.particles.iter_mut().skip(1).step_by(3) {
        p.tag |= WATCHED;
    }
    let flags: Vec<u32> = (0..60).map(|b| [ASLEEP, WATCHED, 0][(b + ask.seed as usize) % 3]).collect();
    Call::new(ask.items.div_ceil(64) + 1)
        .grid(&Grid { count: ask.items as u32, ..grid() })
        .with("particles", &cloud.particles)
        .with("flags", &flags)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (grid, flags): (Grid, Vec<u32>) = (call.buffers.one("grid"), call.buffers.get("flags"));
    let still = |r: [f32; 4]| [0.0, 0.0, 0.0, r[3]];
    let after = |p: &Particle| {
        let at = key(&grid, &Particle { v: [0.0; 3], ..*p });
        if at == NOWHERE || p.tag & QUARANTINED != 0 {
            return *p;
        }
        let flag = flags[at as usize / 64];
        let tag = p.tag & !(ASLEEP | WATCHED) | flag;
        if flag == ASLEEP && p.tag & ASLEEP == 0 {
            Particle { tag, v: [0.0; 3], c0: still(p.c0), c1: still(p.c1), c2: still(p.c2), ..*p }
        } else {
            Particle { tag, ..*p }
        }
    };
    let want: Vec<Particle> = call.buffers.get::<Particle>("particles").iter().map(after).collect();
    vec![Compared::fact("flags and motion", out.bytes("particles") == bytemuck::cast_slice::<_, u8>(&want))]
}

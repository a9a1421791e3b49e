//! Proof of `mpm/survey`: least and greatest coordinates and the largest speed in each block, exactly.

use physvideo_gpu::kernels::{Extent, Grid, Particle};

use super::vec3;
use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::{Lattice, NOWHERE, awake, busy, idle};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/survey",
    inputs,
    compare,
    tolerance: 2e-7,
    reason: "a root of a sum of squares, rounded a few times; places are exact",
    unordered: &[],
    bytes: 40.0,
    flops: 6.0,
};

/// Odd seeds have room for half of the blocks.
fn inputs(ask: Ask) -> Call {
    let cloud = Cloud::new(ask).quarantined();
    let mut sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    if ask.seed % 2 == 1 {
        let room = sorted.blocks.div_ceil(2);
        sorted.grid.capacity = room as u32;
        for block in sorted.list.drain(room..) {
            sorted.table[block as usize] = NOWHERE;
        }
    }
    let awake = awake(ask.items, ask.seed);
    let count = ask.items as u32 - idle(&awake, ask.items);
    Call::new(awake.len().div_ceil(64))
        .grid(&Grid { count, ..sorted.grid })
        .with("particles", &cloud.particles)
        .with("keys", &sorted.keys)
        .with("table", &sorted.table)
        .with("extents", &vec![Extent::default(); sorted.grid.capacity as usize])
        .with("awake", &awake)
}

/// The number that a key stands for: the bits of floats, so changed that they order like them.
fn number(key: u32) -> f64 {
    f64::from(f32::from_bits(if key >= 1 << 31 { key - (1 << 31) } else { !key }))
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let particles: Vec<Particle> = call.buffers.get("particles");
    let (keys, table): (Vec<u32>, Vec<u32>) = (call.buffers.get("keys"), call.buffers.get("table"));
    let busy = busy(&call.buffers.get::<u32>("awake"), particles.len());
    let extents: Vec<Extent> = out.get("extents");
    let mut its: Vec<Vec<usize>> = vec![Vec::new(); extents.len()];
    for p in (0..particles.len()).filter(|p| busy[*p] && keys[*p] != NOWHERE) {
        if let Some(its) = its.get_mut(table[keys[p] as usize / 64].wrapping_sub(1) as usize) {
            its.push(p);
        }
    }
    let (mut got, mut want) = (Vec::new(), Vec::new());
    for (e, its) in extents.iter().zip(&its).filter(|(_, its)| !its.is_empty()) {
        for a in 0..3 {
            let along = || its.iter().map(|p| f64::from(particles[*p].x[a]));
            got.extend([-number(e.low[a]), number(e.high[a])]);
            want.extend([along().fold(f64::INFINITY, f64::min), along().fold(f64::NEG_INFINITY, f64::max)]);
        }
        got.push(f64::from(f32::from_bits(e.speed)));
        want.push(its.iter().map(|p| vec3(&particles[*p].v).norm()).fold(0.0, f64::max));
    }
    let seen: Vec<u32> = its.iter().map(|i| u32::from(!i.is_empty())).collect();
    vec![
        Compared::equal("blocks seen", &extents.iter().map(|e| e.seen).collect::<Vec<_>>(), &seen),
        Compared::near("extent and speed", got, want, 1.0),
    ]
}

//! Proof of `cells/link`: the slots around each slot.

use physvideo_gpu::kernels::Grid;

use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::{Lattice, NOWHERE};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "cells/link",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers",
    unordered: &[],
    bytes: 132.0,
    flops: 0.0,
};

/// Odd seeds have blocks that are claimed but got no slot.
fn inputs(ask: Ask) -> Call {
    let cloud = Cloud::new(ask).quarantined();
    let mut sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let slots = sorted.list.len();
    if ask.seed % 2 == 1 {
        for (i, entry) in sorted.table.iter_mut().enumerate().filter(|(_, entry)| **entry == 0) {
            *entry = if i % 2 == 0 { NOWHERE } else { 0 };
        }
    }
    Call::new(slots + 2)
        .with("table", &sorted.table)
        .with("list", &sorted.list)
        .with("links", &vec![0xabcd_u32; slots * 24])
        .with("fills", &sorted.fills)
        .with("live", &[sorted.counters()])
        .with("wanted", &sorted.links)
        .grid(&sorted.grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    debug_assert!(call.buffers.one::<Grid>("grid").capacity as usize * 24 == out.get::<u32>("links").len());
    vec![Compared::equal("links", &out.get::<u32>("links"), &call.buffers.get::<u32>("wanted"))]
}

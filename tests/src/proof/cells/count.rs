//! Proof of `cells/count`: particles of each cell, and a place in the count for each of them.

use physvideo_gpu::kernels::Clock;

use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::{Lattice, NOWHERE, awake, busy, idle};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "cells/count",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers",
    // Who of a cell comes first is chance; P2G sorts each cell by number.
    unordered: &["ranks"],
    bytes: 20.0,
    flops: 0.0,
};

fn inputs(ask: Ask) -> Call {
    let cloud = Cloud::new(ask).quarantined();
    let mut sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    // Room for fewer blocks than there are: particles of the others are left out.
    if ask.seed % 2 == 1 {
        let room = sorted.blocks.div_ceil(2);
        sorted.grid.capacity = room as u32;
        for block in sorted.list.drain(room..) {
            sorted.table[block as usize] = NOWHERE;
        }
        sorted.counts.truncate(room * 64);
    }
    let awake = awake(ask.items, ask.seed);
    let clock = Clock { particles: ask.items as u32, idle: idle(&awake, ask.items), ..Default::default() };
    Call::new(awake.len().div_ceil(64))
        .with("awake", &awake)
        .with("keys", &sorted.keys)
        .with("table", &sorted.table)
        .with("counts", &vec![0u32; sorted.counts.len()])
        .with("ranks", &vec![NOWHERE; ask.items])
        .with("clock", &[clock])
        .grid(&sorted.grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (keys, table): (Vec<u32>, Vec<u32>) = (call.buffers.get("keys"), call.buffers.get("table"));
    let got: Vec<u32> = out.get("counts");
    let ranks: Vec<u32> = out.get("ranks");
    let mut counts = vec![0; got.len()];
    let mut places: Vec<Vec<u32>> = vec![Vec::new(); got.len()];
    let (mut idle, busy) = (true, busy(&call.buffers.get::<u32>("awake"), keys.len()));
    for (p, key) in keys.iter().enumerate() {
        let slot = if *key == NOWHERE || !busy[p] { NOWHERE } else { table[*key as usize / 64].wrapping_sub(1) };
        match counts.get_mut(slot as usize * 64 + *key as usize % 64) {
            Some(count) => {
                *count += 1;
                places[slot as usize * 64 + *key as usize % 64].push(ranks[p]);
            }
            None => idle &= ranks[p] == NOWHERE,
        }
    }
    let each_once = places.iter_mut().all(|cell| {
        cell.sort_unstable();
        cell.iter().enumerate().all(|(i, rank)| *rank == i as u32)
    });
    vec![
        Compared::equal("counts", &got, &counts),
        Compared::fact("the ranks of a cell are 0, 1, 2, …", each_once),
        Compared::fact("particles in no cell get no rank", idle),
    ]
}

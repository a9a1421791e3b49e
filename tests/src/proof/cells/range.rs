//! Proof of `cells/range`: the cells of a block share one stretch of the order, stretches do not overlap, and the
//! upper neighbours of every block are active.

use std::collections::BTreeSet;

use physvideo_gpu::kernels::{Grid, Live};

use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::{Lattice, NOWHERE, reached};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "cells/range",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers",
    // Blocks take their stretches and neighbours their slots in the order they come.
    unordered: &["starts", "table", "list"],
    bytes: 8.0,
    flops: 6.0,
};

/// Odd seeds have room for one neighbour only.
fn inputs(ask: Ask) -> Call {
    let cloud = Cloud::new(ask).quarantined();
    let mut sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let held = sorted.blocks;
    for block in sorted.list.drain(held..) {
        sorted.table[block as usize] = 0;
    }
    if ask.seed % 2 == 1 {
        sorted.grid.capacity = sorted.grid.capacity.min(held as u32 + 1);
    }
    let room = sorted.grid.capacity as usize;
    sorted.list.resize(room, NOWHERE);
    sorted.counts.truncate(room * 64);
    let live = Live { blocks: held as u32, nodes: held as u32, ..Default::default() };
    Call::new(held)
        .with("counts", &sorted.counts)
        .with("starts", &vec![NOWHERE; room * 64])
        .with("table", &sorted.table)
        .with("list", &sorted.list)
        .with("live", &[live])
        .grid(&sorted.grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let grid: Grid = call.buffers.one("grid");
    let (was, live): (Live, Live) = (call.buffers.one("live"), out.one("live"));
    let held = was.blocks as usize;
    let (counts, starts): (Vec<u32>, Vec<u32>) = (call.buffers.get("counts"), out.get("starts"));
    let total: u32 = counts[..held * 64].iter().sum();
    let mut within = true;
    let mut places = vec![0u32; total as usize];
    for cell in 0..held * 64 {
        within &= cell % 64 == 0 || starts[cell] == starts[cell - 1].wrapping_add(counts[cell - 1]);
        for place in starts[cell]..starts[cell].saturating_add(counts[cell]) {
            if let Some(taken) = places.get_mut(place as usize) {
                *taken += 1;
            }
        }
    }
    let before: Vec<u32> = call.buffers.get("list");
    let (list, table): (Vec<u32>, Vec<u32>) = (out.get("list"), out.get("table"));
    let all: BTreeSet<u32> = before[..held].iter().flat_map(|b| reached(&grid, *b)).collect();
    let room = all.len().min(grid.capacity as usize);
    let listed: BTreeSet<u32> = list[..room].iter().copied().collect();
    let entries = (0..60u32).map(|b| match list.iter().position(|l| *l == b) {
        Some(slot) => slot as u32 + 1,
        None if all.contains(&b) => NOWHERE,
        None => 0,
    });
    vec![
        Compared::fact("the cells of a block follow one another", within),
        Compared::equal("each place is in one cell", &places, &vec![1; total as usize]),
        Compared::fact("blocks with particles keep their slots", list[..held] == before[..held]),
        Compared::fact("upper neighbours once each", listed.len() == room && listed.is_subset(&all)),
        Compared::equal("table", &table, &entries.collect::<Vec<_>>()),
        Compared::equal(
            "live",
            &[live.blocks, live.cursor, live.nodes, live.overflow],
            &[was.blocks, total, all.len() as u32, (all.len() - room) as u32],
        ),
    ]
}

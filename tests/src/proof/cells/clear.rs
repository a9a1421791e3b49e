//! Proof of `cells/clear`: the listed blocks are forgotten, all others stay.

use crate::proof::cloud::grid;
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "cells/clear",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers",
    unordered: &[],
    bytes: 4.0,
    flops: 0.0,
};

/// An item is a cell; slots are whole blocks of 64.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let slots = ask.items.div_ceil(64);
    let mut grid = grid();
    grid.capacity = slots as u32;
    let mut blocks: Vec<u32> = (0..60).collect();
    random.shuffle(&mut blocks);
    let table: Vec<u32> = (0..60).map(|i| 1000 + i).collect();
    let counts: Vec<u32> = (0..slots * 64).map(|_| random.below(9) as u32).collect();
    // Two workgroups more than there is room for: the capacity must stop them.
    Call::new(slots + 2).with("list", &blocks[..slots]).with("table", &table).with("counts", &counts).grid(&grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let mut table: Vec<u32> = call.buffers.get("table");
    for block in call.buffers.get::<u32>("list") {
        table[block as usize] = 0;
    }
    let counts: Vec<u32> = out.get("counts");
    vec![
        Compared::equal("table", &out.get::<u32>("table"), &table),
        Compared::equal("counts", &counts, &vec![0; counts.len()]),
    ]
}

//! Proof of `cells/place`: an order by block and cell that names each sound particle once.

use physvideo_gpu::kernels::Clock;

use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::{Lattice, NOWHERE};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "cells/place",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers",
    unordered: &[],
    bytes: 20.0,
    flops: 0.0,
};

fn inputs(ask: Ask) -> Call {
    let cloud = Cloud::new(ask).quarantined();
    let sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let clock = Clock { particles: ask.items as u32, ..Default::default() };
    Call::new(ask.items.div_ceil(64) + 1)
        .with("keys", &sorted.keys)
        .with("table", &sorted.table)
        .with("starts", &sorted.starts)
        .with("ranks", &sorted.ranks)
        .with("order", &vec![NOWHERE; ask.items])
        .with("clock", &[clock])
        .grid(&sorted.grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (keys, order): (Vec<u32>, Vec<u32>) = (call.buffers.get("keys"), out.get("order"));
    let sound: Vec<u32> = (0..keys.len() as u32).filter(|p| keys[*p as usize] != NOWHERE).collect();
    let (front, back) = order.split_at(sound.len());
    let mut named = front.to_vec();
    named.sort_unstable();
    let mut cells: Vec<u32> = front.iter().map(|p| keys.get(*p as usize).copied().unwrap_or(NOWHERE)).collect();
    let changes = cells.windows(2).filter(|w| w[0] != w[1]).count();
    cells.sort_unstable();
    cells.dedup();
    vec![
        Compared::equal("each sound particle once", &named, &sound),
        Compared::fact("the particles of a cell lie together", changes == cells.len().saturating_sub(1)),
        Compared::fact("nothing behind them", back.iter().all(|p| *p == NOWHERE)),
    ]
}

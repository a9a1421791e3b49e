//! Proof of `cells/place`: an order by block and cell that names each sound particle once.

use physvideo_gpu::kernels::Clock;

use crate::proof::cloud::{Cloud, QUARANTINED, grid};
use crate::proof::lattice::{Lattice, NOWHERE, awake, busy, idle};
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
    let mut cloud = Cloud::new(ask).quarantined();
    let awake = awake(ask.items, ask.seed);
    let busy = busy(&awake, ask.items);
    let left_out = |p: usize| !busy[p];
    for (_, p) in cloud.particles.iter_mut().enumerate().filter(|(i, _)| left_out(*i)) {
        p.tag |= QUARANTINED;
    }
    let mut sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    // What is left out has the key and the rank of an earlier time, which would put it behind all others.
    if let Some(stale) = sorted.keys.iter().copied().find(|key| *key != NOWHERE) {
        let placed = sorted.keys.iter().filter(|key| **key != NOWHERE).count() as u32;
        let cell = (sorted.table[stale as usize / 64] - 1) * 64 + stale % 64;
        for p in (0..ask.items).filter(|p| left_out(*p)) {
            (sorted.keys[p], sorted.ranks[p]) = (stale, placed - sorted.starts[cell as usize]);
        }
    }
    let cells: Vec<u32> =
        sorted.cells().iter().enumerate().map(|(p, c)| if left_out(p) { sorted.keys[p] } else { *c }).collect();
    let clock = Clock { particles: ask.items as u32, idle: idle(&awake, ask.items), ..Default::default() };
    Call::new(awake.len().div_ceil(64))
        .with("awake", &awake)
        .with("keys", &sorted.keys)
        .same("was", "keys")
        .with("table", &sorted.table)
        .with("starts", &sorted.starts)
        .with("ranks", &sorted.ranks)
        .with("order", &vec![NOWHERE; ask.items])
        .with("cells", &cells)
        .with("clock", &[clock])
        .grid(&sorted.grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (keys, order): (Vec<u32>, Vec<u32>) = (call.buffers.get("keys"), out.get("order"));
    let busy = busy(&call.buffers.get::<u32>("awake"), keys.len());
    let sound = |p: &u32| keys[*p as usize] != NOWHERE && busy[*p as usize];
    let sound: Vec<u32> = (0..keys.len() as u32).filter(sound).collect();
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
        Compared::equal("keys", &out.get::<u32>("keys"), &call.buffers.get::<u32>("cells")),
        Compared::fact("nothing behind them", back.iter().all(|p| *p == NOWHERE)),
    ]
}

//! Proof of `cells/locate`: each particle's cell, each touched block listed once, unsound particles set aside.

use std::collections::BTreeSet;

use physvideo_gpu::kernels::{Clock, Grid, Live, Particle};

use crate::proof::cloud::{Cloud, QUARANTINED, grid};
use crate::proof::lattice::{NOWHERE, awake, busy, idle, key};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "cells/locate",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers; inputs keep clear of cell borders, where rounding decides",
    // Which particle claims a block first is chance.
    unordered: &["list", "table"],
    bytes: 36.0,
    flops: 12.0,
};

/// Odd seeds have room for two blocks only.
fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask);
    // One that was set aside earlier stays so, and is not counted again.
    if let Some(p) = cloud.particles.get_mut(40) {
        p.tag |= QUARANTINED;
    }
    let mut grid = grid();
    if ask.seed % 2 == 1 {
        grid.capacity = 2;
    }
    let awake = awake(ask.items, ask.seed);
    let idle = idle(&awake, ask.items);
    let clock = Clock { particles: ask.items as u32, idle, quarantined: 7, left: 2, ..Default::default() };
    Call::new(awake.len().div_ceil(64))
        .with("awake", &awake)
        .with("particles", &cloud.particles)
        .with("keys", &vec![0xabcd_u32; ask.items])
        .with("table", &vec![0u32; 60])
        .same("was", "particles")
        .same("claimed", "table")
        .with("list", &vec![NOWHERE; grid.capacity as usize])
        .with("live", &[Live::default()])
        .grid(&grid)
        .with("clock", &[clock])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let grid: Grid = call.buffers.one("grid");
    let before: Vec<Particle> = call.buffers.get("particles");
    let busy = busy(&call.buffers.get::<u32>("awake"), before.len());
    let old: Vec<u32> = call.buffers.get("keys");
    // Those left out keep the key they had.
    let each = |(i, p)| if busy[i] { key(&grid, p) } else { old[i] };
    let keys: Vec<u32> = before.iter().enumerate().map(each).collect();
    let here = keys.iter().enumerate().filter(|(i, k)| busy[*i] && **k != NOWHERE);
    let touched: BTreeSet<u32> = here.map(|(_, k)| k / 64).collect();
    let (mut after, mut fresh, mut left) = (before.clone(), 0, 0);
    for (p, _) in after.iter_mut().zip(&keys).filter(|(_, k)| **k == NOWHERE) {
        fresh += u32::from(p.tag & QUARANTINED == 0);
        left += u32::from(p.tag & QUARANTINED == 0 && p.x.iter().chain(&p.v).all(|c| c.is_finite()));
        p.tag |= QUARANTINED;
    }
    let (live, clock): (Live, Clock) = (out.one("live"), out.one("clock"));
    let all = touched.len() as u32;
    let held = all.min(grid.capacity);
    let (list, table): (Vec<u32>, Vec<u32>) = (out.get("list"), out.get("table"));
    let listed: BTreeSet<u32> = list[..held as usize].iter().copied().collect();
    let entries = (0..60u32).map(|b| match list.iter().position(|l| *l == b) {
        Some(slot) => slot as u32 + 1,
        None if touched.contains(&b) => NOWHERE,
        None => 0,
    });
    let was: Clock = call.buffers.one("clock");
    vec![
        Compared::equal("keys", &out.get::<u32>("keys"), &keys),
        Compared::fact(
            "particles keep their bits but the flag",
            out.bytes("particles") == bytemuck::cast_slice::<_, u8>(&after),
        ),
        Compared::equal("live.blocks, nodes, overflow", &[live.blocks, live.nodes, live.overflow], &[all, 0, 0]),
        Compared::fact("each listed block once", listed.len() == held as usize && listed.is_subset(&touched)),
        Compared::fact("free slots stay free", list[held as usize..].iter().all(|b| *b == NOWHERE)),
        Compared::equal("table", &table, &entries.collect::<Vec<_>>()),
        Compared::fact("clock", clock == Clock { quarantined: 7 + fresh, left: 2 + left, ..was }),
    ]
}

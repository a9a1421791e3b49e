//! Proof of `cells/range`: the cells of a block share one stretch of the order, stretches do not overlap, and the
//! upper neighbours of every block are active.

use std::collections::BTreeSet;

use physvideo_gpu::kernels::{Clock, Grid, Live, Row};

use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::{Lattice, NOWHERE, reached};
use crate::proof::mpm::clock;
use crate::proof::mpm::grid_rows::ROW_LANES;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "cells/range",
    inputs,
    compare,
    tolerance: clock::CASE.tolerance,
    reason: "integers, and the clock's step",
    // Blocks take their stretches and neighbours their slots in the order they come.
    unordered: &["starts", "table", "list", "spans", "rows", "marks"],
    bytes: 8.0,
    flops: 6.0,
};

/// Odd seeds have room for one neighbour at the most, and for half the rows; every fourth chooses the next substep.
fn inputs(ask: Ask) -> Call {
    let cloud = Cloud::new(ask).quarantined();
    let mut sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let held = sorted.blocks;
    for block in sorted.list.drain(held..) {
        sorted.table[block as usize] = 0;
    }
    if ask.seed % 2 == 1 {
        sorted.grid.capacity = sorted.grid.capacity.min(held as u32 + u32::from(ask.seed % 4 == 1));
        sorted.grid.rows = sorted.grid.rows.div_ceil(2);
    }
    let room = sorted.grid.capacity as usize;
    sorted.list.resize(room, NOWHERE);
    sorted.counts.truncate(room * 64);
    // Blocks that found no slot are dispatched as well.
    let homeless = if ask.seed % 4 == 3 && held > 0 { 2 } else { 0 };
    let live = Live { blocks: (held + homeless) as u32, ..Default::default() };
    Call::new(held + homeless)
        .constant("TICKS", f64::from(u8::from(ticks(ask.seed))))
        .with("clock", &[clock::sample(ask)])
        .with("counts", &sorted.counts)
        .with("starts", &vec![NOWHERE; room * 64])
        .with("spans", &vec![[NOWHERE; 2]; room])
        .with("rows", &vec![nobody(); sorted.grid.rows as usize])
        .with("marks", &vec![NOWHERE; room * 16])
        .with("fills", &vec![NOWHERE; room])
        .with("table", &sorted.table)
        .with("list", &sorted.list)
        .with("live", &[live])
        .grid(&sorted.grid)
}

fn ticks(seed: u64) -> bool {
    seed.is_multiple_of(4)
}

fn nobody() -> Row {
    Row { id: NOWHERE, ..Default::default() }
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let grid: Grid = call.buffers.one("grid");
    let (was, live): (Live, Live) = (call.buffers.one("live"), out.one("live"));
    let held = (was.blocks as usize).min(grid.capacity as usize);
    let homeless = was.blocks - held as u32;
    let (counts, starts): (Vec<u32>, Vec<u32>) = (call.buffers.get("counts"), out.get("starts"));
    let spans: Vec<[u32; 2]> = out.get("spans");
    let total: u32 = counts[..held * 64].iter().sum();
    let held_in = |row: usize| counts[row * 4..row * 4 + 4].iter().sum::<u32>();
    let mut within = true;
    let mut places = vec![0u32; total as usize];
    for cell in 0..held * 64 {
        // Cells of a row follow one another, and stay in the stretch of their block.
        if held_in(cell / 4) > 0 {
            let [first, all] = spans[cell / 64];
            let place = starts[cell].wrapping_sub(first);
            within &= place <= all && place + counts[cell] <= all;
            within &= cell % 4 == 0 || starts[cell] == starts[cell - 1].wrapping_add(counts[cell - 1]);
        }
        let end = if counts[cell] > 0 { starts[cell].saturating_add(counts[cell]) } else { starts[cell] };
        for place in starts[cell]..end {
            if let Some(taken) = places.get_mut(place as usize) {
                *taken += 1;
            }
        }
    }
    // The list and the marks name the same rows; those beyond its room are named nowhere.
    let filled = (0..held * 16).filter(|row| held_in(*row) > 0).count();
    let (rows, marks): (Vec<Row>, Vec<u32>) = (out.get("rows"), out.get("marks"));
    let listed_rows = filled.min(grid.rows as usize);
    let mut named: Vec<u32> = rows[..listed_rows].iter().map(|r| r.id).collect();
    let before: Vec<u32> = call.buffers.get("list");
    let agree = rows[..listed_rows].iter().enumerate().all(|(at, r)| {
        let id = r.id as usize;
        id < held * 16
            && marks[id] == at as u32 + 1
            && (r.first, r.count, r.block) == (starts[id * 4], held_in(id), before[id / 16])
    });
    named.sort_unstable();
    named.dedup();
    let marked = marks[..held * 16].iter().filter(|m| **m != 0).count();
    let groups = (listed_rows.div_ceil(ROW_LANES)) as u32;
    let (list, table): (Vec<u32>, Vec<u32>) = (out.get("list"), out.get("table"));
    let all: BTreeSet<u32> = (0..held * 64)
        .filter(|cell| counts[*cell] > 0)
        .flat_map(|cell| reached(&grid, before[cell / 64] * 64 + cell as u32 % 64))
        .chain(before[..held].iter().copied())
        .collect();
    let fills: Vec<u32> =
        (0..held).map(|slot| (0..16).filter(|r| held_in(slot * 16 + r) > 0).fold(0, |bits, r| bits | 1 << r)).collect();
    let room = all.len().min(grid.capacity as usize);
    let listed: BTreeSet<u32> = list[..room].iter().copied().collect();
    let entries = (0..60u32).map(|b| match list.iter().position(|l| *l == b) {
        Some(slot) => slot as u32 + 1,
        None if all.contains(&b) => NOWHERE,
        None => 0,
    });
    let (clock, now): (Clock, Clock) = (call.buffers.one("clock"), out.one("clock"));
    let ticked = call.constants == call.constants.clone().with("TICKS", 1.0) && held > 0;
    let mut compared =
        if ticked { clock::compare_clock(&clock, &was, &now) } else { vec![Compared::fact("no tick", clock == now)] };
    compared.extend([
        Compared::fact("cells follow one another in the stretch of their block", within),
        Compared::fact("the list of rows and their marks agree", agree),
        Compared::equal("rows listed once, and marked", &[named.len() as u32, marked as u32], &[listed_rows as u32; 2]),
        Compared::equal("each place is in one cell", &places, &vec![1; total as usize]),
        Compared::fact("blocks with particles keep their slots", list[..held] == before[..held]),
        Compared::fact("upper neighbours once each", listed.len() == room && listed.is_subset(&all)),
        Compared::equal("fills", &out.get::<u32>("fills")[..held], &fills),
        Compared::equal("table", &table, &entries.collect::<Vec<_>>()),
        Compared::equal(
            "live",
            &[live.blocks, live.cursor, live.nodes, live.overflow],
            &[was.blocks, total, all.len() as u32 + homeless, (all.len() - room) as u32 + homeless],
        ),
        Compared::equal(
            "live rows",
            &[live.rows, live.row_groups, live.crowded],
            &[filled as u32, groups, (filled - listed_rows) as u32],
        ),
    ]);
    compared
}

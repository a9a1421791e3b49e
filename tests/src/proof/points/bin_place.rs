//! Proof of `points/bin_place`: the list of each tile names its points once each, as far as there is room.

use std::collections::BTreeSet;

use physvideo_gpu::kernels::Room;

use super::{NOTHING, SIZE, each, lists, scenery, seen, starts};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "points/bin_place",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers, and squares that f32 bounds exactly",
    // Who of a tile comes first is chance; what is drawn does not depend on it.
    unordered: &["list"],
    bytes: 32.0,
    flops: 20.0,
};

/// Odd seeds have room for half of the entries.
fn inputs(ask: Ask) -> Call {
    let splats = scenery::discs(ask, SIZE);
    let counts: Vec<u32> = lists(&seen(&splats), SIZE).iter().map(|t| t.len() as u32).collect();
    let total: u32 = counts.iter().sum();
    let room = if ask.seed % 2 == 1 { total / 2 } else { total };
    each(ask.items, ask)
        .immediates(&Room { width: SIZE[0], height: SIZE[1], points: ask.items as u32, room })
        .with("splats", &splats)
        .with("starts", &starts(&counts))
        .with("list", &vec![NOTHING; room as usize])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let tiles = lists(&seen(&call.buffers.get::<[f32; 4]>("splats")), SIZE);
    let (starts, list): (Vec<u32>, Vec<u32>) = (call.buffers.get("starts"), out.get("list"));
    let ends: Vec<u32> = starts.iter().zip(&tiles).map(|(s, t)| s + t.len() as u32).collect();
    let mut named = true;
    for ((tile, start), end) in tiles.iter().zip(&starts).zip(&ends) {
        let stretch = &list[list.len().min(*start as usize)..list.len().min(*end as usize)];
        let once: BTreeSet<u32> = stretch.iter().copied().collect();
        named &= once.len() == stretch.len() && once.is_subset(&tile.iter().copied().collect());
    }
    vec![
        Compared::equal("starts become ends", &out.get::<u32>("starts"), &ends),
        Compared::fact("each list names points of its tile, once", named),
    ]
}

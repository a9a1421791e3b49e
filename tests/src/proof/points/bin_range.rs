//! Proof of `points/bin_range`: tiles get stretches of the list that do not overlap and leave nothing out.

use physvideo_gpu::kernels::{Bins, Screen};

use super::{NOTHING, each};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "points/bin_range",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "integers",
    // Workgroups take their stretches in the order they come.
    unordered: &["starts"],
    bytes: 8.0,
    flops: 6.0,
};

/// An item is a tile. Seeds of 3 in four have longer lists than can be counted.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed);
    let most = if ask.seed % 4 == 3 { 1 << 26 } else { 300 };
    let counts: Vec<u32> = (0..ask.items).map(|_| (random.below(most) * random.below(2)) as u32).collect();
    let down = if ask.items.is_multiple_of(4) { 4 } else { 1 };
    let (width, height) = ((ask.items / down * 8) as u32, down as u32 * 8);
    // The last tiles of a row and a column are cut.
    let screen = Screen { width: width.saturating_sub(5), height: height - 3, points: 9 };
    each(ask.items, ask)
        .immediates(&screen)
        .with("counts", &counts)
        .with("starts", &vec![NOTHING; ask.items])
        .with("bins", &[Bins::default()])
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (counts, starts): (Vec<u32>, Vec<u32>) = (call.buffers.get("counts"), out.get("starts"));
    let total: u64 = counts.iter().map(|c| u64::from(*c)).sum();
    let wraps = total > u64::from(u32::MAX);
    let mut stretches: Vec<_> = starts.iter().zip(&counts).filter(|(_, c)| **c > 0).collect();
    stretches.sort();
    let mut next = 0;
    let whole = stretches.iter().all(|(start, count)| {
        let follows = **start == next;
        next = start.wrapping_add(**count);
        follows
    });
    let bins: Bins = out.one("bins");
    vec![
        Compared::fact("stretches follow one another", wraps || whole),
        Compared::equal("total, wrapped", &[bins.total, bins.wrapped], &[total as u32, u32::from(wraps)]),
    ]
}

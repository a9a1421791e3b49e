//! Proof of `mpm/p2g_fixed`: the sums of `mpm/p2g` in fixed point, whatever their order.

use super::p2g;
use crate::proof::{Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/p2g_fixed",
    inputs: p2g::tile_inputs,
    compare,
    tolerance: 6e-6,
    reason: "each of a node's shares is rounded to 2^-20 of the block's largest, at most half a step each",
    unordered: &[],
    bytes: p2g::CASE.bytes,
    flops: p2g::CASE.flops,
};

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let mut compared = p2g::compare_tiles(call, out);
    // Rounding averages out over all nodes, truncation would drain momentum and mass.
    let totals = [compared[0].total("momentum in all", 0.05), compared[1].total("mass in all", 0.05)];
    compared.extend(totals);
    compared
}

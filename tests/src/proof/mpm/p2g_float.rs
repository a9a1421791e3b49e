//! Proof of `mpm/p2g_float`: the sums of `mpm/p2g` with float atomics, in any order.

use super::p2g;
use crate::proof::Case;

pub static CASE: Case = Case {
    kernel: "mpm/p2g_float",
    inputs: p2g::tile_inputs,
    compare: p2g::compare_tiles,
    tolerance: p2g::CASE.tolerance,
    reason: "as mpm/p2g: the order of a few dozen terms moves the sum by less than the weights' error",
    // Which atomic comes first is chance, and float addition is not associative.
    unordered: &["tiles"],
    bytes: p2g::CASE.bytes,
    flops: p2g::CASE.flops,
};

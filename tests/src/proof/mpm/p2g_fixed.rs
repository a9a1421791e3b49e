//! Proof of `mpm/p2g_fixed`: the sums of `mpm/p2g` in fixed point, whatever their order.

use super::p2g;
use crate::proof::Case;

pub static CASE: Case = Case {
    kernel: "mpm/p2g_fixed",
    inputs: p2g::inputs,
    compare: p2g::compare_tiles,
    tolerance: 6e-6,
    reason: "each of a node's shares is rounded to 2^-20 of the block's largest, at most half a step each",
    unordered: &[],
    bytes: p2g::CASE.bytes,
    flops: p2g::CASE.flops,
};

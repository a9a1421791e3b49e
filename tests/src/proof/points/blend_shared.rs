//! Proof of `points/blend_shared`: the pixels of `points/blend` without subgroups.

use super::blend;
use crate::proof::Case;

pub static CASE: Case = Case {
    kernel: "points/blend_shared",
    inputs: blend::inputs,
    compare: blend::compare,
    tolerance: blend::CASE.tolerance,
    reason: blend::CASE.reason,
    unordered: &[],
    bytes: blend::CASE.bytes,
    flops: blend::CASE.flops,
};

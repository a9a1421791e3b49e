//! Proofs of `wgsl/cells`: which blocks are active, and in which order the particles lie.

pub mod clear;
pub mod count;
pub mod link;
pub mod locate;
pub mod place;
pub mod range;

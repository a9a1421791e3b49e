//! Proofs of `wgsl/source`.

pub mod recycle;

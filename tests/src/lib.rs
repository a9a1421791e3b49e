//! Proofs of the kernels and the tools to run them: an f64 twin and a case per kernel, and the harness that checks
//! and times them. Nothing that ships imports this crate.

pub mod demo;
pub mod device;
pub mod flow;
pub mod folder;
pub mod liquid;
pub mod plot;
pub mod probe;
pub mod problems;
pub mod proof;
pub mod random;
pub mod stress;
pub mod twins;

//! Proofs, physics, stress and benches over the engine; nothing that ships imports this crate.

pub mod twins;

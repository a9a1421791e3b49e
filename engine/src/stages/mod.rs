//! The stages: each records kernels over buffers. A stage knows the world and the GPU, never another stage; only `mpm` takes
//! `lagrangian` as a guest, where a scene needs both.

pub mod cells;
pub mod display;
pub mod emit;
pub mod energy;
pub mod lagrangian;
pub mod latent;
pub mod mpm;
pub mod render;
pub mod solver;
pub mod source;
pub mod sph;
pub mod view;

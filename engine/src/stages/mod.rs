//! Stages: each records kernels over buffers into a recording. They do not know each other.

pub mod render;
pub mod view;

//! The simulation over the GPU layer: a *Scene* compiles to a *Plan*, stages record kernels over buffers.
//! Does no file I/O: it is given scene text and decoded arrays, so it can be used as a library.

pub mod accuracy;
pub mod animate;
pub mod assemble;
pub mod backdrop;
pub mod cap;
mod crossing;
mod domain;
pub mod elastic;
mod emission;
pub mod estimate;
mod filling;
pub mod flow;
pub mod fluid;
pub mod geometry;
mod holes;
mod idle;
mod limits;
mod pins;
pub mod plan;
mod pocket;
pub mod scene;
pub mod stages;
mod walls;
pub mod world;

//! The scene: what a user wrote, as plain data.

mod model;

pub use model::*;

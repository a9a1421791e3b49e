//! The same computations in f64, each written from its definition and not from the kernel.

pub mod points;

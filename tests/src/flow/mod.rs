//! Φ_CF against laws that are known: data with an exact velocity, closed forms of every integrator, the law of a chain
//! by quadrature, the noise in f64, and Algorithm 1 on the device and on the host.

pub mod data;
pub mod forget;
pub mod laws;
pub mod noise;
pub mod run;
pub mod schedule;
pub mod transfer;

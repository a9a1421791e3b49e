//! What every solver offers to whoever plays a clip: frames, sums over bodies, particles to draw. Knows no solver.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use physvideo_gpu::kernels::{Deformation, Particle};
use physvideo_gpu::{Buf, GpuError};

/// What happened in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Substeps taken, those of rejected attempts included.
    pub substeps: u32,
    /// Smallest and largest substep [s].
    pub dt: (f32, f32),
    /// Grid nodes, or particles where there is no grid, slowed down to the speed limit.
    pub clamped_velocity: u32,
    /// Particle updates whose stretch was limited.
    pub clamped_strain: u32,
    /// Particle updates whose compression was refused.
    pub clamped_volume: u32,
    /// Particles taken out: not finite, or outside the grid.
    pub quarantined: u32,
    /// Groups of 64 particles that each substep worked on; those not emitted yet and those asleep are in none.
    pub groups: u32,
    /// Bodies at rest that were left out.
    pub asleep: u32,
    /// Particles that left an emitter.
    pub emitted: u32,
    /// Particles that started anew at their source.
    pub recycled: u32,
    /// Attempts at the frame that were taken back and repeated with smaller steps.
    pub rejected: u32,
    /// The frame was given up as [`Solver::stop_when`] asked; nothing has moved.
    pub stopped: bool,
}

/// Sums over one body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    /// Mass [kg].
    pub mass: f64,
    /// Momentum [kg m/s].
    pub momentum: [f64; 3],
    /// Angular momentum of the particles about the origin [kg m²/s], without the part in C.
    pub spin: [f64; 3],
    /// Kinetic energy [J].
    pub kinetic: f64,
    /// Elastic energy [J].
    pub elastic: f64,
    /// Σ m z [kg m].
    pub height: f64,
    /// Particles in quarantine.
    pub quarantined: u32,
    /// Largest speed [m/s].
    pub speed: f64,
}

/// A solver over one world: its bodies in the order of the world's, their particles body after body.
pub trait Solver {
    /// Advances by one frame of `length` seconds.
    ///
    /// # Errors
    /// The device's refusal.
    fn frame(&mut self, length: f32) -> Result<FrameStats, GpuError>;

    /// Sums over body `index`.
    ///
    /// # Errors
    /// The device's refusal.
    fn measure(&self, index: usize) -> Result<Measure, GpuError>;

    /// Simulated time [s].
    fn time(&self) -> f64;

    /// Gives a frame up between two submissions once this is true; the state stays that of the frame before.
    fn stop_when(&mut self, asked: Arc<AtomicBool>);

    /// The particles, body after body, as they are between two frames.
    fn particles(&self) -> Buf<Particle>;

    /// Their deformation; what is drawn of a photograph follows it.
    fn deformations(&self) -> Buf<Deformation>;

    /// From when to when each body was left out because it was at rest [s].
    fn left_out(&self) -> Vec<Vec<[f64; 2]>> {
        Vec::new()
    }

    /// Whether the same run gives the same bits on this device.
    fn deterministic(&self) -> bool;
}

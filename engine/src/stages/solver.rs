//! What every solver offers to whoever plays a clip: frames, sums over bodies, particles to draw. Knows no solver.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use physvideo_gpu::kernels::{Deformation, Particle, Sums};
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
    /// Of those, finite ones that left the grid's domain: no fault of the steps.
    pub left: u32,
    /// Particles of a liquid found deeper in an obstacle than half of their size at the end of the frame.
    pub sunk: u32,
    /// Groups of 64 particles that each substep worked on; those not emitted yet and those asleep are in none.
    pub groups: u32,
    /// Particles at rest that were asleep.
    pub asleep: u32,
    /// Attempts at the frame that were taken back because motion came to what was asleep.
    pub woken: u32,
    /// Particles that left an emitter.
    pub emitted: u32,
    /// Particles that started anew at their source.
    pub recycled: u32,
    /// Attempts at the frame that were taken back and repeated with smaller steps.
    pub rejected: u32,
    /// Steps of SPH that searched for neighbours; the others kept the lists they had.
    pub searches: u32,
    /// Iterations of the solves for pressure and viscosity, where there are any.
    pub iterations: u32,
    /// Solves of them that ended with more error than they may have.
    pub unsolved: u32,
    /// Attempts that ended with more energy than can have come in; where shorter steps do not help, the last is kept.
    pub gained: u32,
    /// The frame was kept with a fault that shorter steps did not mend, and faults like it are no longer looked for.
    pub unmended: bool,
    /// Energy that obstacles and new starts of particles brought in, as far as it is counted [J].
    pub work: f64,
    /// The frame asked for steps too short ever to end it; nothing has moved.
    pub stalled: Option<Fastest>,
    /// A liquid has no room between obstacles that move.
    pub pressed: Option<Pressed>,
    /// The frame was given up as [`Solver::stop_when`] asked; nothing has moved.
    pub stopped: bool,
}

/// A liquid for which obstacles leave too little room.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pressed {
    /// Body that has the most particles there.
    pub body: u32,
    /// Volume that is left [m³].
    pub left: f64,
    /// Volume of the liquid [m³].
    pub needed: f64,
}

/// The particle that asks for the shortest step, as far as its own motion and stretch say.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fastest {
    /// Its place in the particle buffer.
    pub particle: u32,
    /// Its body.
    pub body: u32,
    /// Its speed [m/s].
    pub speed: f32,
    /// Largest component of its deformation gradient.
    pub stretch: f32,
    /// Its volume over that at rest.
    pub volume: f32,
}

impl Fastest {
    /// The one of `particles` that is not finite, or fastest, stretched or squeezed most for its body's wave speed [m/s].
    pub fn of(particles: &[Particle], deformations: &[Deformation], waves: &[f32]) -> Option<Self> {
        let size = |v: &[f32]| v.iter().map(|c| c * c).sum::<f32>().sqrt();
        let largest = |v: &[f32]| v.iter().fold(0.0, |most: f32, c| if c.abs() <= most { most } else { c.abs() });
        let wave = |f: &Self| waves.get(f.body as usize).copied().unwrap_or(0.0);
        let ask = |f: &Self| f.speed + wave(f) * f.stretch.max(1.0 / f.volume.abs()).max(1.0);
        // Of a liquid J alone is kept.
        let volume = |d: &Deformation| {
            let [a, b, c] = [d.f0, d.f1, d.f2].map(|c| glam::Vec3::new(c[0], c[1], c[2]));
            if b == c { a.x } else { a.dot(b.cross(c)) }
        };
        let rank = |f: &Self| if ask(f).is_finite() { ask(f) } else { f32::INFINITY };
        let all = particles.iter().zip(deformations).zip(0..).map(|((p, d), particle)| Self {
            particle,
            body: p.tag & 0xff,
            speed: size(&p.v),
            stretch: [&d.f0[..3], &d.f1[..3], &d.f2[..3]].map(largest).into_iter().fold(0.0, f32::max),
            volume: volume(d),
        });
        all.max_by(|a, b| rank(a).total_cmp(&rank(b)).then(b.particle.cmp(&a.particle)))
    }
}

/// All bodies, to `mpm/measure` (`EVERY` in WGSL).
pub(super) const EVERY: u32 = u32::MAX;

/// Sums over one body, or over all.
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
    /// Energy in the gravity that acts on each body, −Σ m g·x [J].
    pub potential: f64,
    /// Energy of the motion in C, on cells of the solver's size [J].
    pub affine: f64,
}

impl Measure {
    /// The total of partial sums, added in f64, on cells of `dx` [m].
    pub fn of(sums: &[Sums], dx: f32) -> Self {
        let mut out = Self::default();
        for s in sums {
            for a in 0..3 {
                out.momentum[a] += f64::from(s.momentum[a]);
                out.spin[a] += f64::from(s.spin[a]);
            }
            out.mass += f64::from(s.momentum[3]);
            out.kinetic += f64::from(s.spin[3]);
            out.elastic += f64::from(s.elastic);
            out.height += f64::from(s.height);
            out.quarantined += s.lost as u32;
            out.speed = out.speed.max(f64::from(s.speed));
            out.potential += f64::from(s.potential);
            out.affine += f64::from(dx * dx) / 4.0 * f64::from(s.affine);
        }
        out
    }

    /// Kinetic and elastic energy, that of the motion in C included [J].
    pub fn energy(&self) -> f64 {
        self.kinetic + self.affine + self.elastic
    }
}

/// A time in which some particles of a body were asleep without a break.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Nap {
    /// When it began [s].
    pub from: f64,
    /// When it ended [s].
    pub to: f64,
    /// How many particles slept at the most.
    pub particles: u32,
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

    /// When particles of each body were asleep.
    fn left_out(&self) -> Vec<Vec<Nap>> {
        Vec::new()
    }

    /// Whether the same run gives the same bits on this device.
    fn deterministic(&self) -> bool;
}

/// Calls that `Clock.runs` counts (`RUNS` in WGSL): stretches of particles, and from [`CALLS`] on those of bodies on grids
/// of their own.
pub(super) const RUNS: usize = 15;
/// The first of the latter.
pub(super) const CALLS: usize = 8;

/// Bits of a particle's tag that number its body (`BODY_MASK` in WGSL).
pub const BODY: u32 = 0xff;
/// Flag of a particle that is held (`PINNED` in WGSL).
pub const PINNED: u32 = 0x4000_0000;
/// Flag of a particle at rest that gives to the grid at the most (`ASLEEP` in WGSL).
pub const ASLEEP: u32 = 0x1000_0000;
/// Flag of a particle beside those asleep, to tell when motion comes (`WATCHED` in WGSL).
pub const WATCHED: u32 = 0x0200_0000;
/// Flag of a particle of SPH that is still in its nozzle and moves as that says (`LED` in WGSL).
pub const LED: u32 = 0x0400_0000;
/// Flag of a particle that is not emitted yet, or no more (`DORMANT` in WGSL); comes with [`QUARANTINED`].
pub const DORMANT: u32 = 0x0800_0000;
/// Flag of a particle whose F is not that of its whole motion (`FLOWS` in WGSL).
pub const FLOWS: u32 = 0x2000_0000;
/// Flag of a particle that was taken out (`QUARANTINED` in WGSL).
pub const QUARANTINED: u32 = 0x8000_0000;

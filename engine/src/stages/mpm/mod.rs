//! MLS-MPM (Hu 2018; Stomakhin 2013): particles carry state, the grid carries one substep.
//! Records a batch of substeps once and submits it until the device says that the frame is done.

mod awake;
mod frame;
mod guest;
mod play;
mod reach;
mod rest;
mod run;
mod start;
mod substep;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use physvideo_gpu::kernels::{self, Clock, Colliders, Deformation, Extent, Forces, Particle, Sums, mpm};
use physvideo_gpu::{Buf, Constants, DeviceKind, Feature, Gpu, GpuError, Prepared, Recording};

use self::guest::Guest;
use self::rest::Rest;
use self::run::{MOST_RUNS, Run, Stretch, runs};
use self::start::{constants, initial_state, room};
use super::cells::{self, Cells};
use super::emit::Emitter;
use super::energy::Budget;
use super::lagrangian::Lagrangian;
pub use super::solver::{ASLEEP, DORMANT, FLOWS, PINNED, QUARANTINED};
use super::solver::{CALLS, EVERY, Measure, RUNS};
use super::source::Recycling;
use crate::world::World;

/// How particles give to the grid. All three give the same sums up to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum P2g {
    /// A lane a row of four cells, no atomics; same bits on every run. For CPU devices.
    Cell,
    /// A lane a particle, integer atomics in workgroup memory; same bits on every run. For GPUs.
    Fixed,
    /// A lane a particle, subgroup sums and native float atomics; bits vary from run to run.
    Float,
}

/// Choices that do not change what is simulated.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Transfer to the grid; absent: chosen by the device.
    pub p2g: Option<P2g>,
    /// Same bits on every run.
    pub deterministic: bool,
    /// Stress and deformation by the gradient of the B-spline instead of the MLS form.
    pub true_gradient: bool,
    /// Blocks in which nothing moves are left out until something comes near.
    pub sleep: bool,
    /// Substeps in a command buffer.
    pub batch: u32,
}

impl Default for Method {
    fn default() -> Self {
        Self { p2g: None, deterministic: true, true_gradient: true, sleep: false, batch: 32 }
    }
}

/// The solver over one world.
pub struct Mpm<'gpu> {
    gpu: &'gpu Gpu,
    /// The particles, body after body.
    pub particles: Buf<Particle>,
    /// Their deformation.
    pub deformations: Buf<Deformation>,
    bodies: Buf<kernels::Body>,
    forces: Buf<Forces>,
    clock: Buf<Clock>,
    colliders: Buf<Colliders>,
    saved: (Buf<Particle>, Buf<Deformation>),
    sums: Buf<Sums>,
    /// What particles give to nodes: 54 shares an occupied row, or a tile of 6³ nodes a slot.
    given: Buf<[f32; 4]>,
    nodes: Buf<[f32; 4]>,
    cells: Cells,
    recycling: Option<Recycling>,
    constants: Constants,
    method: Method,
    p2g: P2g,
    batch: Option<Prepared<'gpu>>,
    time: f64,
    courant: f32,
    wave_speed: f32,
    force_dt: f32,
    longest: f32,
    stop: Option<Arc<AtomicBool>>,
    /// Frames that go wrong are repeated with smaller steps.
    guarded: bool,
    /// What a frame's energy is held against; absent where steps are forced, and once shorter ones did not help.
    budget: Option<Budget>,
    /// What one step of the count of work stands for [J].
    work_unit: f32,
    /// Largest |v| + c of a particle [m/s].
    speed: f32,
    dx: f32,
    ranges: Vec<std::ops::Range<u64>>,
    /// Speed of each body's waves at rest [m/s].
    waves: Vec<f32>,
    runs: Vec<Run>,
    emitters: Vec<Emitter>,
    /// The particles that substeps work on, and where those of each run are among them.
    listed: Vec<u32>,
    stretches: [Stretch; MOST_RUNS],
    rest: Rest,
    /// Some particles may have flags of `rest`.
    flagged: bool,
    /// Those of each block of the grid.
    flags: Buf<u32>,
    /// What is seen of each slot.
    extents: Buf<Extent>,
    /// Bodies that are on grids of their own.
    guests: Vec<bool>,
    guest: Option<Guest<'gpu>>,
}

impl<'gpu> Mpm<'gpu> {
    /// Uploads a world.
    ///
    /// # Errors
    /// The device's refusal of a buffer or a kernel.
    pub fn new(gpu: &'gpu Gpu, world: &World, method: Method) -> Result<Self, GpuError> {
        Self::build(gpu, world, method, &vec![false; world.bodies.len()])
    }

    /// Without what moves the `guests`.
    fn build(gpu: &'gpu Gpu, world: &World, method: Method, guests: &[bool]) -> Result<Self, GpuError> {
        let count: u64 = world.bodies.iter().map(|b| b.positions.len() as u64).sum();
        let (mut particles, deformations) = initial_state(world);
        let emitters = Emitter::all(world, &mut particles, &deformations);
        guest::leave_out(world, guests, &mut particles);
        let mut ranges = Vec::new();
        let mut first = 0;
        for body in &world.bodies {
            ranges.push(first..first + body.positions.len() as u64);
            first += body.positions.len() as u64;
        }
        let grid = cells::grid(world.domain, world.dx);
        let room = room(world, &grid);
        let (forces, colliders) = (world.forces(), world.obstacles());
        let p2g = method.p2g.unwrap_or(match gpu.info.kind {
            DeviceKind::Cpu => P2g::Cell,
            _ if !method.deterministic && gpu.has(Feature::FloatAtomic) && gpu.has(Feature::Subgroup) => P2g::Float,
            _ => P2g::Fixed,
        });
        let speed = world
            .bodies
            .iter()
            .flat_map(|b| &b.velocities)
            .map(|v| v.iter().map(|c| c * c).sum::<f32>())
            .fold(0.0, f32::max);
        let mut mpm = Self {
            gpu,
            particles: gpu.upload("run", "mpm/particles", &particles)?,
            deformations: gpu.upload("run", "mpm/deformations", &deformations)?,
            bodies: gpu.upload(
                "run",
                "mpm/bodies",
                &world.bodies.iter().map(|b| b.constants(world.gravity, world.dx)).collect::<Vec<_>>(),
            )?,
            forces: gpu.upload("run", "mpm/forces", &[forces])?,
            clock: gpu.alloc("run", "mpm/clock", 1)?,
            colliders: gpu.upload("run", "mpm/colliders", &[colliders])?,
            saved: (
                gpu.alloc("run", "mpm/saved_particles", count)?,
                gpu.alloc("run", "mpm/saved_deformations", count)?,
            ),
            sums: gpu.alloc("run", "mpm/sums", count.div_ceil(64))?,
            given: gpu.alloc("grid", "mpm/given", room.given(p2g))?,
            nodes: gpu.alloc("grid", "mpm/nodes", 64 * u64::from(room.slots))?,
            cells: Cells::new(gpu, grid, count, room.slots, room.rows)?,
            recycling: Recycling::new(gpu, world)?,
            constants: constants(world, method),
            method,
            p2g,
            batch: None,
            time: 0.0,
            courant: world.courant,
            wave_speed: world.wave_speeds().0,
            force_dt: world.force_dt.unwrap_or(0.0),
            longest: world.longest_step(),
            stop: None,
            guarded: world.force_dt.is_none(),
            budget: world.force_dt.is_none().then(|| Budget::new(world)),
            work_unit: 1.0,
            waves: world.bodies.iter().map(|b| b.step_speed(world.dx)).collect(),
            speed: speed.sqrt() + world.wave_speeds().1,
            dx: world.dx,
            ranges,
            runs: runs(world, method, guests),
            emitters,
            listed: Vec::new(),
            stretches: Default::default(),
            rest: Rest::new(world, &grid, method.sleep),
            flagged: false,
            flags: gpu.alloc("run", "mpm/flags", grid.blocks.iter().map(|b| u64::from(*b)).product())?,
            extents: gpu.alloc("grid", "mpm/extents", room.slots.into())?,
            guests: guests.to_vec(),
            guest: None,
        };
        mpm.update_stress()?;
        mpm.choose_particles()?;
        Ok(mpm)
    }

    /// Bytes that [`Mpm::new`] will allocate, with whichever transfer takes more, before any is made.
    pub fn bytes(world: &World) -> u64 {
        let particles: u64 = world.bodies.iter().map(|b| b.positions.len() as u64).sum();
        let grid = cells::grid(world.domain, world.dx);
        let room = room(world, &grid);
        let each = (2 * (size_of::<Particle>() + size_of::<Deformation>()) + 1) as u64;
        let given = room.given(P2g::Cell).max(room.given(P2g::Fixed));
        let sort = Cells::bytes(&grid, particles, room.slots, room.rows);
        each * particles
            + 16 * (given + 64 * u64::from(room.slots))
            + sort
            + Recycling::bytes(world)
            + size_of::<Extent>() as u64 * u64::from(room.slots)
            + 4 * grid.blocks.iter().map(|b| u64::from(*b)).product::<u64>()
    }

    /// The same where the bodies that `own` names, if any, are on grids of their own.
    pub fn bytes_beside(world: &World, own: &[bool]) -> u64 {
        let gifts = 12 * 64 * u64::from(room(world, &cells::grid(world.domain, world.dx)).slots);
        let guests = if own.contains(&true) { gifts + Lagrangian::bytes_of(world, own) } else { 0 };
        Self::bytes(world) + guests
    }

    /// Which transfer is used.
    pub fn p2g(&self) -> P2g {
        self.p2g
    }

    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Bodies' ranges in the particle buffer.
    pub fn ranges(&self) -> &[std::ops::Range<u64>] {
        &self.ranges
    }

    fn prepare(&mut self) -> Result<(), GpuError> {
        if self.batch.is_none() {
            let mut rec = Recording::new("substeps");
            for _ in 0..self.method.batch.max(1) {
                self.record_substep(&mut rec);
            }
            self.batch = Some(self.gpu.prepare(&rec)?);
        }
        Ok(())
    }

    /// Begins a frame of `length` seconds without running it, for whoever submits substeps recorded with
    /// [`Mpm::record_substep`].
    ///
    /// # Errors
    /// The device's refusal.
    pub fn start_clock(&self, length: f32) -> Result<(), GpuError> {
        self.begin(length, false)
    }

    /// Sets the clock to the begin of a frame, and finds the particles' cells.
    fn begin(&self, length: f32, watch: bool) -> Result<(), GpuError> {
        self.set_clock(length, watch)?;
        // A frame that was given up between two substeps has left the cells for the next.
        self.cells.start_anew(self.gpu)?;
        let mut locate = Recording::new("locate");
        self.record_locate(&mut locate);
        self.gpu.run(&locate).map(|_| ())
    }

    fn set_clock(&self, length: f32, watch: bool) -> Result<(), GpuError> {
        let clock = Clock {
            frame_start: self.time as f32,
            frame_length: length,
            dx: self.dx,
            courant: self.courant,
            longest: self.longest,
            watch: u32::from(watch),
            wave_speed: self.wave_speed,
            force_dt: self.force_dt,
            speed_bits: self.speed.to_bits(),
            particles: self.particles_in_use(),
            idle: self.particles_in_use() - self.listed.len() as u32,
            particle_groups: [self.listed.len().div_ceil(64) as u32, 1, 1],
            runs: self.run_groups(),
            starts: self.stretches.map(|s| s.start),
            work_unit: self.work_unit,
            stir: rest::STIR * self.dx / length,
            ..Default::default()
        };
        self.gpu.write(self.clock, 0, &[clock])
    }

    fn run_groups(&self) -> [[u32; 4]; RUNS] {
        let mut all = [[0, 1, 1, 0]; RUNS];
        for (run, its) in all.iter_mut().zip(&self.stretches) {
            *run = [its.count.div_ceil(64), 1, 1, its.count];
        }
        if let Some(guest) = &self.guest {
            all[CALLS..].copy_from_slice(&guest.solver.calls());
        }
        all
    }

    fn particles_in_use(&self) -> u32 {
        self.ranges.last().map_or(0, |r| r.end as u32)
    }

    fn update_stress(&mut self) -> Result<(), GpuError> {
        self.set_clock(1.0, false)?;
        let Self { particles, deformations, bodies, clock, .. } = *self;
        let mut rec = Recording::new("stress");
        let stress = mpm::Stress { particles, deformations, bodies, clock };
        rec.each(&stress, &self.constants, self.particles_in_use().into());
        self.gpu.run(&rec).map(|_| ())
    }

    /// Sums over body `index`.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn measure(&self, index: usize) -> Result<Measure, GpuError> {
        if let Some(measure) = self.measure_guest(index) {
            return measure;
        }
        self.sums_over(index as u32)
    }

    /// Sums over one body, or over all where `body` is [`EVERY`].
    fn sums_over(&self, body: u32) -> Result<Measure, GpuError> {
        let count = self.particles_in_use();
        let immediates = kernels::Only { body, count };
        let Self { particles, deformations, bodies, sums, .. } = *self;
        let mut rec = Recording::new("measure");
        let call = mpm::Measure { particles, deformations, bodies, sums, immediates };
        rec.each(&call, &self.constants, u64::from(count));
        self.gpu.run(&rec)?;
        let mut all = Measure::of(&self.gpu.read(sums)?, self.dx);
        if let (EVERY, Some(guest)) = (body, &self.guest) {
            all.elastic += guest.solver.untold()?;
        }
        Ok(all)
    }
}

//! A frame: batches of substeps until the device says that it is done, and the guard behind them.

use std::sync::atomic::Ordering;

use physvideo_gpu::kernels::Clock;
use physvideo_gpu::{GpuError, Groups, Recording};

use super::{BATCH, Lagrangian};
use crate::stages::energy::work;
use crate::stages::solver::{CALLS, Fastest, FrameStats, RUNS};

/// Attempts at a frame that are taken back.
const MOST_REJECTED: u32 = 3;
/// Share of the energy in motion and deformation that may have come from nowhere in a frame: near the limit Verlet's energy
/// swings by a tenth, and a step beyond the limit doubles it in a few steps.
const MOST_GAINED: f64 = 0.2;
/// What the Courant number is multiplied by then. A point alone in its cell has Σ g²/w = 4.36 along each axis, so it stands
/// 0.958 / sqrt((3λ + 2μ)/(λ + 2μ)), 0.69 at ν = 0.32 and 0.59 at ν = 0.45; 0.75 comes below that at once.
const SMALLER: f32 = 0.78;

/// What a call has a lane for, and which of the clock's runs from [`CALLS`] on counts them.
#[derive(Clone, Copy)]
pub(super) enum Items {
    Nodes,
    /// Cells that something may push, and the others.
    Touched,
    Inside,
    Skins,
    /// Cells with thin parts.
    Thin,
    /// Of surfaces that may meet.
    Facets,
    /// All cells, where what is inside meets obstacles.
    Cells,
}

impl Lagrangian<'_> {
    fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|asked| asked.load(Ordering::Relaxed))
    }

    /// Begins a frame of `length` seconds without running it, for whoever submits substeps recorded with
    /// [`Lagrangian::record_substep`].
    ///
    /// # Errors
    /// The device's refusal.
    pub fn start_clock(&self, length: f32) -> Result<(), GpuError> {
        self.begin(length, false)
    }

    fn begin(&self, length: f32, watch: bool) -> Result<(), GpuError> {
        let lanes = self.lanes();
        let mut runs = [[0, 1, 1, 0]; RUNS];
        runs[CALLS..].copy_from_slice(&self.calls());
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
            particles: lanes,
            particle_groups: [lanes.div_ceil(64), 1, 1],
            runs,
            work_unit: self.work_unit,
            ..Default::default()
        };
        self.gpu.write(self.clock, 0, &[clock])
    }

    /// Workgroups and items of each call, as the clock counts them.
    pub(in crate::stages) fn calls(&self) -> [[u32; 4]; RUNS - CALLS] {
        [Items::Nodes, Items::Touched, Items::Inside, Items::Skins, Items::Thin, Items::Facets, Items::Cells]
            .map(|items| [self.items(items).div_ceil(64), 1, 1, self.items(items)])
    }

    /// Ends a frame: the last half of the last kick (the clock has stopped, dt is 0), and the particles.
    pub(super) fn finish(&mut self) -> Result<(), GpuError> {
        let mut rec = Recording::new("finish");
        self.record_step(&mut rec, false, |items| Groups::Direct([self.items(items).div_ceil(64), 1, 1]));
        self.gpu.run(&rec)?;
        self.sample()
    }

    /// How many there are.
    pub(super) fn items(&self, items: Items) -> u32 {
        match items {
            Items::Nodes => self.sizes.nodes,
            Items::Touched => self.sizes.touched,
            Items::Inside => self.sizes.cells - self.sizes.touched,
            Items::Skins => self.sizes.skins,
            Items::Thin => self.sizes.thin,
            Items::Facets => self.facets(),
            Items::Cells => self.sizes.cells,
        }
    }

    /// The longest of the kernels; the clock counts workgroups for it.
    fn lanes(&self) -> u32 {
        self.sizes.nodes.max(self.sizes.cells).max(self.sizes.skins).max(self.facets())
    }

    fn facets(&self) -> u32 {
        let beside = self.matter.as_ref().map_or(0, |m| m.facets());
        self.pairs.as_ref().map_or(beside, |p| p.sizes.facets)
    }

    /// Runs batches until the device says that `length` seconds have passed, or gives the attempt up.
    fn attempt(&mut self, length: f32, watch: bool) -> Result<Clock, GpuError> {
        self.begin(length, watch)?;
        if self.batch.is_none() {
            let mut rec = Recording::new("substeps");
            (0..BATCH).for_each(|_| self.record_substep(&mut rec));
            self.batch = Some(self.gpu.prepare(&rec)?);
        }
        loop {
            if let Some(batch) = &self.batch {
                batch.submit()?;
            }
            let clock = self.gpu.read(self.clock)?[0];
            if clock.particle_groups[0] == 0 || self.stopped() {
                return Ok(clock);
            }
        }
    }

    /// Advances by one frame of `length` seconds.
    ///
    /// A frame in which a body ran away (‖F‖ over 17) or a node was not finite is taken back as soon as that shows, and
    /// one in which energy came from nowhere (see [`super::super::energy::Budget`]) at its end; it is repeated with a Courant
    /// number 0.78 times as large, which the run then keeps. Three times a frame at most; where that does not help, the run
    /// returns to its own steps, and what happens is counted.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn frame(&mut self, length: f32) -> Result<FrameStats, GpuError> {
        let mut stats = FrameStats::default();
        if self.sizes.cells == 0 {
            self.time += f64::from(length);
            return Ok(stats);
        }
        let (mut save, mut back) = (Recording::new("save"), Recording::new("back"));
        self.record_save(&mut save);
        self.record_back(&mut back);
        self.gpu.run(&save)?;
        let began = self.courant;
        let before = if self.judges { Some(self.energy()?) } else { None };
        if let Some(sums) = &before {
            self.work_unit = self.budget.unit(sums);
        }
        loop {
            let again = stats.rejected < MOST_REJECTED;
            let watch = self.guarded && again;
            let clock = self.attempt(length, watch)?;
            stats.substeps += clock.substeps;
            if clock.particle_groups[0] > 0 {
                self.gpu.run(&back)?;
                stats.stopped = true;
                return Ok(stats);
            }
            let stalled = clock.stalled != 0;
            let bad = clock.clamped_velocity + clock.quarantined > 0 || stalled;
            self.finish()?;
            let gained = match &before {
                Some(before) if !bad => {
                    let (now, came) = (self.energy()?, work(&self.gpu.read(self.clock)?[0]));
                    let gain = now.kinetic - self.budget.most(before, &now, came, self.time, length.into());
                    gain.is_nan() || gain > MOST_GAINED * now.kinetic + self.noise
                }
                _ => false,
            };
            stats.gained += u32::from(gained);
            if (bad && watch) || (gained && again) {
                self.gpu.run(&back)?;
                stats.rejected += 1;
                self.courant *= SMALLER;
                continue;
            }
            if stalled {
                let (particles, deformations) = (self.gpu.read(self.particles)?, self.gpu.read(self.deformations)?);
                stats.stalled = Fastest::of(&particles, &deformations, &[]);
                self.gpu.run(&back)?;
                return Ok(stats);
            }
            if bad && self.guarded {
                (self.guarded, self.courant, stats.unmended) = (false, began, true);
            }
            if gained {
                (self.judges, self.courant, stats.unmended) = (false, began, true);
            }
            self.speed = f32::from_bits(clock.speed_bits);
            stats.dt = (clock.dt_min, clock.dt_max);
            stats.clamped_velocity = clock.clamped_velocity;
            stats.clamped_strain = clock.clamped_strain;
            stats.clamped_volume = clock.clamped_volume;
            stats.quarantined = clock.quarantined;
            self.time += f64::from(length);
            return Ok(stats);
        }
    }
}

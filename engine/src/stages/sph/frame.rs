//! A frame: batches of steps until the device says that it is done, and the guard behind them.

use std::ops::Range;
use std::sync::atomic::Ordering;

use physvideo_gpu::kernels::{Clock, Descent, Solve};
use physvideo_gpu::{GpuError, Recording};

use super::Sph;
use super::start::no_lists;
use crate::fluid::SOUND;
use crate::scene::Pressure;
use crate::stages::cells::Cells;
use crate::stages::energy::{Budget, work};
use crate::stages::solver::{EVERY, Fastest, FrameStats, Pressed};

/// Attempts at a frame that are taken back.
const MOST_REJECTED: u32 = 3;
/// What the Courant number is multiplied by then.
const SMALLER: f32 = 0.5;
/// Compression, as a share of the volume, from which on a weakly compressible liquid may have no room: a hit at 6 m/s
/// stagnates at half of it.
const TIGHT: f64 = 0.1;
/// One in so many particles in obstacles is no chance.
const MANY: u32 = 50;
/// Frames without a fault after which it is doubled again: a splash passes.
const CALM: u32 = 3;

impl Sph<'_> {
    fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|asked| asked.load(Ordering::Relaxed))
    }

    fn prepare(&mut self) -> Result<(), GpuError> {
        if self.batch.is_none() {
            let mut rec = Recording::new("steps");
            let solves = self.fluid.pressure == Pressure::Dfsph || self.viscous.is_some();
            let steps = if solves { 4 } else { 32 };
            for _ in 0..steps {
                self.record_step(&mut rec);
            }
            self.batch = Some(self.gpu.prepare(&rec)?);
        }
        Ok(())
    }

    /// Begins a frame of `length` seconds without running it, for whoever submits steps recorded with
    /// [`Sph::record_step`].
    ///
    /// # Errors
    /// The device's refusal.
    pub fn start_clock(&self, length: f32) -> Result<(), GpuError> {
        self.begin(length, false)
    }

    /// Longest step of a frame [s]. Walls come no nearer in it than particles may: what is at rest does not see them come.
    fn longest(&self, length: f32) -> f32 {
        let soon = |when: &Range<f64>| when.start < self.time + f64::from(length) && when.end > self.time;
        let swiftest = self.motions.iter().filter(|m| soon(&m.0)).map(|m| m.1).fold(0.0, f32::max);
        let met = self.limits.courant * self.fluid.particle_size / (self.limits.speed + swiftest);
        self.limits.longest.min(if swiftest > 0.0 { met } else { f32::MAX })
    }

    fn begin(&self, length: f32, watch: bool) -> Result<(), GpuError> {
        let clock = Clock {
            frame_start: self.time as f32,
            frame_length: length,
            dx: self.fluid.particle_size,
            courant: self.courant,
            // A frame that is taken back is repeated with shorter steps whatever bounds them.
            longest: self.longest(length) * (self.courant / self.limits.courant),
            watch: u32::from(watch),
            wave_speed: self.limits.speed,
            force_dt: self.force_dt,
            speed_bits: self.speed.to_bits(),
            particles: self.count,
            particle_groups: [self.listed.len().div_ceil(64) as u32, 1, 1],
            idle: self.count - self.listed.len() as u32,
            work_unit: self.work_unit,
            ..Default::default()
        };
        self.gpu.write(self.solve, 0, &[Solve::default()])?;
        if let Some(viscous) = &self.viscous {
            self.gpu.write(viscous.descent, 0, &[Descent::default()])?;
        }
        self.gpu.write(self.clock, 0, &[clock])
    }

    /// Runs batches until the device says that `length` seconds have passed, or gives the attempt up.
    fn attempt(&mut self, length: f32, watch: bool) -> Result<Clock, GpuError> {
        self.begin(length, watch)?;
        if let Some(recycling) = &self.recycling {
            recycling.reset(self.gpu)?;
        }
        self.prepare()?;
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

    /// Lets the emitters' particles out; how many.
    fn emit(&mut self, length: f32) -> Result<u32, GpuError> {
        let (mut emitted, mut changed) = (0, false);
        for emitter in &mut self.emitters {
            let (came, any) = emitter.advance(self.gpu, self.particles, self.deformations, self.time, length.into())?;
            emitted += came;
            changed |= any;
            // They are the first to move where all else rests, and the step is chosen before they do.
            if came > 0 {
                self.speed = self.speed.max(emitter.speed() + self.limits.speed);
            }
        }
        if changed {
            self.choose_particles()?;
        }
        Ok(emitted)
    }

    /// Advances by one frame of `length` seconds.
    ///
    /// A frame in which a particle ran away or was no longer finite, or that ends with more energy than can have come in (see
    /// [`Budget`]), is taken back and repeated with half the Courant number, which doubles again after every third frame
    /// without a fault; three times a frame at most. Where that does not help, the run returns to its own steps, and what
    /// happens is counted.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn frame(&mut self, length: f32) -> Result<FrameStats, GpuError> {
        let mut stats = FrameStats::default();
        if self.count == 0 {
            self.time += f64::from(length);
            return Ok(stats);
        }
        stats.emitted = self.emit(length)?;
        stats.groups = self.listed.len().div_ceil(64) as u32;
        if self.listed.is_empty() {
            self.time += f64::from(length);
            return Ok(stats);
        }
        let mut save = Recording::new("save");
        save.copy(self.particles, self.saved);
        if let Some(shift) = &self.shift {
            save.copy(shift.debts, shift.saved);
        }
        self.gpu.run(&save)?;
        let mut back = Recording::new("back");
        back.copy(self.saved, self.particles);
        if let Some(shift) = &self.shift {
            back.copy(shift.saved, shift.debts);
        }
        let began = self.courant;
        let span = (self.time, f64::from(length));
        let before = if self.budget.is_some() { Some(self.energies()?) } else { None };
        if let (Some(sums), Some(budget)) = (&before, &self.budget) {
            self.work_unit = budget.unit(sums);
            if sums.elastic > sums.mass * (f64::from(SOUND) * TIGHT).powi(2) {
                stats.pressed = self.pressed(span.0)?;
                if stats.pressed.is_some() {
                    return Ok(stats);
                }
            }
        }
        loop {
            let again = stats.rejected < MOST_REJECTED;
            let watch = self.guarded && again;
            let clock = self.attempt(length, watch)?;
            stats.substeps += clock.substeps;
            stats.searches += self.gpu.read(self.keep)?[0].searches;
            if clock.particle_groups[0] > 0 {
                self.gpu.run(&back)?;
                stats.stopped = true;
                return Ok(stats);
            }
            if self.gpu.read(self.cells.live)?[0].overflow > 0 {
                self.gpu.run(&back)?;
                self.make_room()?;
                continue;
            }
            let stalled = clock.stalled != 0;
            let bad = clock.clamped_velocity + clock.quarantined - clock.left > 0 || stalled;
            let gained = match &before {
                Some(before) if !bad => {
                    let after = self.sums_over(EVERY)?;
                    let came = work(&clock) - self.taken(clock.left)?;
                    let allows = |b: &mut Budget| b.allows(before, &after, came, span.0, span.1);
                    !self.budget.as_mut().is_none_or(allows)
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
                stats.pressed = self.pressed(span.0 + span.1)?;
                return Ok(stats);
            }
            if bad && self.guarded {
                (self.guarded, self.courant, stats.unmended) = (false, began, true);
            }
            if gained {
                (self.budget, self.courant, stats.unmended) = (None, began, true);
            }
            self.calm = if stats.rejected > 0 { 0 } else { self.calm + 1 };
            if self.calm > 0 && self.calm.is_multiple_of(CALM) {
                self.courant = (self.courant / SMALLER).min(self.limits.courant);
            }
            let solve = self.gpu.read(self.solve)?[0];
            self.speed = f32::from_bits(clock.speed_bits);
            stats.dt = (clock.dt_min, clock.dt_max);
            stats.work = work(&clock);
            stats.clamped_velocity = clock.clamped_velocity;
            stats.clamped_volume = clock.clamped_volume;
            stats.quarantined = clock.quarantined;
            stats.left = clock.left;
            stats.sunk = clock.sunk;
            if let Some(recycling) = &self.recycling {
                stats.recycled = recycling.recycled(self.gpu)?;
            }
            stats.iterations = solve.all;
            stats.unsolved = solve.unsolved;
            if let Some(viscous) = &self.viscous {
                let descent = self.gpu.read(viscous.descent)?[0];
                stats.iterations += descent.all;
                stats.unsolved += descent.unsolved;
            }
            if stats.unmended || stats.sunk > self.count / MANY {
                stats.pressed = self.pressed(span.0 + span.1)?;
            }
            self.time += f64::from(length);
            return Ok(stats);
        }
    }

    /// The liquid that has no room between obstacles as they are at `time`; looked for where something goes wrong.
    fn pressed(&self, time: f64) -> Result<Option<Pressed>, GpuError> {
        if self.motions.iter().all(|m| m.0.start > time) {
            return Ok(None);
        }
        Ok(self.pockets.pressed(&self.gpu.read(self.particles)?, time))
    }

    /// Energy that `left` particles have taken out of the domain in this frame [J].
    fn taken(&self, left: u32) -> Result<f64, GpuError> {
        let Some(budget) = self.budget.as_ref().filter(|_| left > 0) else { return Ok(0.0) };
        Ok(budget.taken(&self.gpu.read(self.saved)?, &self.gpu.read(self.particles)?))
    }

    /// Doubles the number of blocks there is room for.
    fn make_room(&mut self) -> Result<(), GpuError> {
        let grid = self.cells.grid;
        let dense: u64 = grid.blocks.iter().map(|b| u64::from(*b)).product();
        let slots = (2 * u64::from(grid.capacity)).min(dense) as u32;
        self.batch = None;
        self.gpu.free_arena("grid");
        // The list of blocks is a new one, and empty.
        self.gpu.write(self.keep, 0, &[no_lists()])?;
        self.cells = Cells::new(self.gpu, grid, u64::from(self.count), slots, self.count.max(1))?;
        self.choose_particles()
    }
}

//! A frame: batches of substeps until the device says that it is done, and the guard behind them.

use std::sync::atomic::Ordering;

use physvideo_gpu::kernels::Clock;
use physvideo_gpu::{GpuError, Recording};

use super::Mpm;
use super::start::Room;
use crate::stages::cells::Cells;
use crate::stages::energy::work;
use crate::stages::solver::{EVERY, Fastest, FrameStats};

/// Attempts at a frame that are taken back.
const MOST_REJECTED: u32 = 3;
/// What the Courant number is multiplied by then. A particle nearly alone oscillates by itself: Σ g²/w over the nodes of
/// an axis is at most 6, so volume changes need dt < 2 dx / sqrt(18 K/ρ), a Courant number of 0.587 at ν = 0.32; 0.75
/// comes below that at once.
const SMALLER: f32 = 0.78;

impl Mpm<'_> {
    fn stopped(&self) -> bool {
        self.stop.as_ref().is_some_and(|asked| asked.load(Ordering::Relaxed))
    }

    /// Runs batches until the device says that `length` seconds have passed, or gives the attempt up.
    fn advance(&mut self, length: f32, watch: bool) -> Result<Clock, GpuError> {
        self.begin(length, watch)?;
        if let Some(recycling) = &self.recycling {
            recycling.reset(self.gpu)?;
        }
        self.prepare()?;
        let mut taken = 0;
        loop {
            if let Some(batch) = &self.batch {
                batch.submit()?;
            }
            let mut clock = self.gpu.read(self.clock)?[0];
            if clock.substeps == taken {
                clock.particle_groups[0] = 0; // time goes on where particles are, and none is left
            }
            if clock.particle_groups[0] == 0 || self.stopped() {
                return Ok(clock);
            }
            taken = clock.substeps;
        }
    }

    /// Lets the emitters' particles out; how many.
    fn emit(&mut self, length: f32) -> Result<u32, GpuError> {
        let (mut emitted, mut changed) = (0, false);
        for emitter in &mut self.emitters {
            let (gpu, time) = (self.gpu, self.time);
            let (came, any) = emitter.advance(gpu, self.particles, self.deformations, time, length.into())?;
            emitted += came;
            changed |= any;
        }
        if changed {
            self.choose_particles()?;
        }
        Ok(emitted)
    }

    /// Advances by one frame of `length` seconds.
    ///
    /// A frame in which a node ran away, a particle was no longer finite or time stood still is taken back as soon as that
    /// shows, one that ends with more energy than can have come in at its end (see [`super::super::energy::Budget`]), and both
    /// are repeated with a Courant number 0.78 times as large, which the run then keeps: no step is safe for a particle nearly alone
    /// (Bai & Schroeder 2022), and how far a body is from that changes slowly. Three times a frame at most; where that
    /// does not help, the run returns to its own steps, and what happens is counted. One in which motion came to what sleeps
    /// is repeated with more awake.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn frame(&mut self, length: f32) -> Result<FrameStats, GpuError> {
        let mut stats = FrameStats::default();
        if self.particles_in_use() == 0 {
            self.time += f64::from(length);
            return Ok(stats);
        }
        stats.emitted = self.emit(length)?;
        self.wake(length)?;
        if self.listed.is_empty() {
            if let Some(alone) = self.guests_alone(length)? {
                stats = FrameStats { emitted: stats.emitted, ..alone };
            }
            if !stats.stopped && stats.stalled.is_none() {
                self.time += f64::from(length);
            }
            stats.asleep = self.rest.asleep();
            self.rest.remember(self.time, length);
            return Ok(stats);
        }
        let mut save = Recording::new("save");
        save.copy(self.particles, self.saved.0);
        save.copy(self.deformations, self.saved.1);
        self.guest.iter().for_each(|g| g.solver.record_save(&mut save));
        self.gpu.run(&save)?;
        let mut back = Recording::new("back");
        back.copy(self.saved.0, self.particles);
        back.copy(self.saved.1, self.deformations);
        self.guest.iter().for_each(|g| g.solver.record_back(&mut back));
        let began = self.courant;
        let span = (self.time, f64::from(length));
        let before = if self.budget.is_some() { Some(self.sums_over(EVERY)?) } else { None };
        if let (Some(sums), Some(budget)) = (&before, &self.budget) {
            self.work_unit = budget.unit(sums);
        }
        loop {
            let again = stats.rejected < MOST_REJECTED;
            let watch = self.guarded && again;
            let clock = self.advance(length, watch)?;
            stats.substeps += clock.substeps;
            if clock.particle_groups[0] > 0 {
                self.gpu.run(&back)?;
                stats.stopped = true;
                return Ok(stats);
            }
            if let Some(guest) = &mut self.guest {
                guest.solver.sample()?;
            }
            let live = self.gpu.read(self.cells.live)?[0];
            let stalled = clock.stalled != 0;
            let bad = clock.clamped_velocity + clock.quarantined - clock.left > 0 || stalled;
            if live.overflow + live.crowded > 0 {
                self.gpu.run(&back)?;
                self.make_room(live.overflow > 0, live.crowded > 0)?;
                continue;
            }
            if clock.stirred > 0 {
                self.gpu.run(&back)?;
                self.rest.reach_further();
                self.wake(length)?;
                self.gpu.run(&save)?;
                stats.woken += 1;
                continue;
            }
            let gained = match &before {
                Some(before) if !bad => {
                    let after = self.sums_over(EVERY)?;
                    let came = work(&clock) - self.taken(clock.left)?;
                    self.budget.as_mut().is_some_and(|b| !b.allows(before, &after, came, span.0, span.1))
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
                stats.stalled = self.fastest()?;
                self.gpu.run(&back)?;
                return Ok(stats);
            }
            if bad && self.guarded {
                (self.guarded, self.courant, stats.unmended) = (false, began, true);
            }
            if gained {
                (self.budget, self.courant, stats.unmended) = (None, began, true);
            }
            self.speed = f32::from_bits(clock.speed_bits);
            stats.dt = (clock.dt_min, clock.dt_max);
            stats.clamped_velocity = clock.clamped_velocity;
            stats.clamped_strain = clock.clamped_strain;
            stats.clamped_volume = clock.clamped_volume;
            stats.quarantined = clock.quarantined;
            stats.left = clock.left;
            stats.work = work(&clock);
            if let Some(recycling) = &self.recycling {
                stats.recycled = recycling.recycled(self.gpu)?;
            }
            stats.groups = self.listed.len().div_ceil(64) as u32;
            stats.asleep = self.rest.asleep();
            self.time += f64::from(length);
            self.settle(length)?;
            return Ok(stats);
        }
    }

    /// Energy that `left` particles have taken out of the domain in this frame [J].
    fn taken(&self, left: u32) -> Result<f64, GpuError> {
        let Some(budget) = self.budget.as_ref().filter(|_| left > 0) else { return Ok(0.0) };
        Ok(budget.taken(&self.gpu.read(self.saved.0)?, &self.gpu.read(self.particles)?))
    }

    /// The particle that asks for the shortest step.
    fn fastest(&self) -> Result<Option<Fastest>, GpuError> {
        let (particles, deformations) = (self.gpu.read(self.particles)?, self.gpu.read(self.deformations)?);
        Ok(Fastest::of(&particles, &deformations, &self.waves))
    }

    /// Doubles the number of blocks or of occupied rows there is room for.
    fn make_room(&mut self, slots: bool, rows: bool) -> Result<(), GpuError> {
        let grid = self.cells.grid;
        let now = Room { slots: grid.capacity, rows: grid.rows };
        let room = now.doubled(&grid, self.particles_in_use(), slots, rows);
        self.batch = None;
        self.gpu.free_arena("grid");
        self.given = self.gpu.alloc("grid", "mpm/given", room.given(self.p2g))?;
        self.nodes = self.gpu.alloc("grid", "mpm/nodes", 64 * u64::from(room.slots))?;
        self.extents = self.gpu.alloc("grid", "mpm/extents", room.slots.into())?;
        self.cells = Cells::new(self.gpu, grid, u64::from(self.particles_in_use()), room.slots, room.rows)?;
        self.move_guest()?;
        self.choose_particles()
    }
}

//! Which particles a substep works on: none that are not emitted yet, none that sleep far from all that moves.

use bytemuck::Zeroable;
use physvideo_gpu::kernels::{Extent, Grid, mpm};
use physvideo_gpu::{Constants, GpuError, Recording};

use super::Mpm;
use super::run::Stretch;

impl Mpm<'_> {
    /// Tells the sort which particles are worked on.
    pub(super) fn choose_particles(&mut self) -> Result<(), GpuError> {
        let emitted = |body: usize| match self.guests[body] {
            true => Some(vec![]),
            false => self.emitters.iter().find(|e| e.body == body).map(|e| e.out()),
        };
        self.listed = self.rest.list(&self.ranges, emitted);
        let mut start = 0;
        for (stretch, run) in self.stretches.iter_mut().zip(&self.runs) {
            let its = self.listed.iter().filter(|p| (run.first..run.first + run.count).contains(p));
            *stretch = Stretch { start, count: its.count() as u32 };
            start += stretch.count;
        }
        self.cells.sort_only(self.gpu, &self.listed)
    }

    /// Chooses who sleeps in a frame of `length` [s].
    pub(super) fn wake(&mut self, length: f32) -> Result<(), GpuError> {
        if !self.rest.on() {
            return Ok(());
        }
        self.rest.decide(self.time, length);
        let flags = self.rest.flags();
        if flags.is_none() && !self.flagged {
            return Ok(());
        }
        self.flagged = flags.is_some();
        let flags = flags.unwrap_or_else(|| vec![0; self.flags.len() as usize]);
        self.gpu.write(self.flags, 0, &flags)?;
        let mut rec = Recording::new("settle");
        let immediates = Grid { count: self.particles_in_use(), ..self.cells.grid };
        let Self { particles, flags, .. } = *self;
        let settle = mpm::Settle { particles, flags, immediates };
        rec.each(&settle, &Constants::none(), u64::from(self.particles_in_use()));
        self.gpu.run(&rec)?;
        self.choose_particles()
    }

    /// Looks at what has moved in the frame of `length` [s] that has just ended.
    pub(super) fn settle(&mut self, length: f32) -> Result<(), GpuError> {
        if !self.rest.on() {
            return Ok(());
        }
        self.begin(length, false)?;
        let slots = self.gpu.read(self.cells.live)?[0].blocks.min(self.cells.capacity);
        self.gpu.write(self.extents, 0, &vec![Extent::zeroed(); slots as usize])?;
        let count = self.listed.len() as u32;
        let immediates = Grid { count, ..self.cells.grid };
        let Self { particles, extents, .. } = *self;
        let crate::stages::cells::Cells { awake, keys, table, .. } = self.cells;
        let survey = mpm::Survey { particles, keys, table, extents, awake, immediates };
        let mut rec = Recording::new("survey");
        rec.each(&survey, &Constants::none(), u64::from(count));
        self.gpu.run(&rec)?;
        let list = self.gpu.read_range(self.cells.list, 0, slots.into())?;
        let extents = self.gpu.read_range(self.extents, 0, slots.into())?;
        let seen: Vec<(u32, Extent)> = list.into_iter().zip(extents).collect();
        let keys = self.gpu.read(self.cells.keys)?;
        self.rest.look(&self.listed, &keys, &seen, self.time, length);
        Ok(())
    }
}

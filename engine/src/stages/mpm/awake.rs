//! Which particles a substep works on, in groups of 64: none that are not emitted yet, none of a body asleep.

use bytemuck::Zeroable;
use physvideo_gpu::kernels::{Asked, Extent, mpm};
use physvideo_gpu::{Constants, GpuError, Groups, Recording};

use super::{ASLEEP, Mpm};
use crate::stages::cells::groups;

impl Mpm<'_> {
    /// Tells the sort which groups hold anything that moves.
    pub(super) fn choose_groups(&mut self) -> Result<(), GpuError> {
        let bodies = self.ranges.iter().enumerate();
        let busy = bodies.flat_map(|(i, all)| match self.emitters.iter().find(|e| e.body == i) {
            _ if self.rest.asleep(i) || self.guests[i] => vec![],
            Some(emitter) => emitter.out().to_vec(),
            None => vec![all.clone()],
        });
        self.groups = groups(busy);
        self.cells.sort_only(self.gpu, &self.groups)
    }

    /// Wakes the bodies that something will reach in a frame of `length` [s].
    pub(super) fn wake(&mut self, length: f32) -> Result<(), GpuError> {
        let woken = self.rest.wake(self.time, length);
        self.flag(&woken, |tag| tag & !ASLEEP)
    }

    /// Leaves out the bodies that have come to rest in the frame of `length` [s] that has just ended.
    pub(super) fn settle(&mut self, length: f32) -> Result<(), GpuError> {
        if !self.rest.on() {
            return Ok(());
        }
        self.gpu.write(self.extents, 0, &vec![Extent::zeroed(); self.ranges.len()])?;
        let mut rec = Recording::new("survey");
        let immediates = Asked { count: self.particles_in_use() };
        let Self { particles, extents, .. } = *self;
        let survey = mpm::Survey { particles, extents, awake: self.cells.awake, immediates };
        rec.call(&survey, &Constants::none(), Groups::Direct([self.groups.len() as u32, 1, 1]));
        self.gpu.run(&rec)?;
        let seen = self.gpu.read(self.extents)?;
        let tired = self.rest.settle(&seen, self.time, length);
        self.flag(&tired, |tag| tag | ASLEEP)
    }

    /// Changes the flags of all particles of some bodies.
    fn flag(&mut self, bodies: &[usize], change: impl Fn(u32) -> u32) -> Result<(), GpuError> {
        if bodies.is_empty() {
            return Ok(());
        }
        for range in bodies.iter().map(|i| self.ranges[*i].clone()) {
            let mut its = self.gpu.read_range(self.particles, range.start, range.end - range.start)?;
            its.iter_mut().for_each(|p| p.tag = change(p.tag));
            self.gpu.write(self.particles, range.start, &its)?;
        }
        self.choose_groups()
    }

    /// Groups of 64 that hold any of `count` particles from `first` on and are worked on.
    pub(super) fn busy_groups(&self, first: u32, count: u32) -> u32 {
        let (low, high) = (first / 64, (first + count).div_ceil(64));
        self.groups.iter().filter(|g| (low..high).contains(g)).count() as u32
    }
}

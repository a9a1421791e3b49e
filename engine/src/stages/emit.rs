//! Emitters: an object's particles leave its source layer by layer, as out of a nozzle, and return to the pool when their
//! life is over. Runs on the host between frames; particles not emitted cost nothing there and nothing on the device.

use std::ops::Range;

use physvideo_gpu::kernels::{Deformation, Particle};
use physvideo_gpu::{Buf, Gpu, GpuError};

use super::mpm::{DORMANT, QUARANTINED};
use crate::world::{Emission, World};

/// The emitter of one body.
#[derive(Clone, Debug)]
pub struct Emitter {
    /// Its body.
    pub body: usize,
    emission: Emission,
    /// Its particles in the buffer, a ring.
    pool: Range<u64>,
    /// They as they leave, at the nozzle.
    start: Vec<(Particle, Deformation)>,
    /// Emitted so far, and of those the ones whose life is over.
    next: u64,
    over: u64,
}

impl Emitter {
    /// The emitters of a world, whose particles it makes dormant.
    pub fn all(world: &World, particles: &mut [Particle], deformations: &[Deformation]) -> Vec<Self> {
        let mut first = 0;
        let mut found = Vec::new();
        for (body, b) in world.bodies.iter().enumerate() {
            let pool = first..first + b.positions.len();
            first = pool.end;
            let Some(emission) = b.emission.clone() else { continue };
            let start = particles[pool.clone()].iter().copied().zip(deformations[pool.clone()].iter().copied());
            let start = start.collect();
            for p in &mut particles[pool.clone()] {
                p.tag |= DORMANT | QUARANTINED;
            }
            let pool = pool.start as u64..pool.end as u64;
            found.push(Self { body, emission, pool, start, next: 0, over: 0 });
        }
        found
    }

    /// Particles of its pool that are out, at most two stretches of it.
    pub fn out(&self) -> [Range<u64>; 2] {
        self.stretches(self.over..self.next)
    }

    /// Where in the pool the particles are that were emitted as numbers `these`.
    fn stretches(&self, these: Range<u64>) -> [Range<u64>; 2] {
        let room = self.pool.end - self.pool.start;
        let at = |n: u64| self.pool.start + n % room;
        let none = self.pool.start..self.pool.start;
        match these.end - these.start {
            0 => [none.clone(), none],
            n if at(these.start) + n <= self.pool.end => [at(these.start)..at(these.start) + n, none],
            _ => [at(these.start)..self.pool.end, self.pool.start..at(these.end)],
        }
    }

    /// Lets out what is due within `length` [s] of `time` [s], takes back what has lived long enough by `time`. Particles
    /// stand as far behind the nozzle as they need to reach it when they are due, so a jet has no gaps whatever the
    /// length of a frame. Returns how many came out, and whether any particle came or went.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn advance(
        &mut self,
        gpu: &Gpu,
        particles: Buf<Particle>,
        deformations: Buf<Deformation>,
        time: f64,
        length: f64,
    ) -> Result<(u32, bool), GpuError> {
        let room = self.pool.end - self.pool.start;
        let lasts = self.emission.lifetime.unwrap_or(f64::INFINITY);
        let mut over = self.over;
        while over < self.next && self.emission.due(over) + lasts <= time {
            over += 1;
        }
        for gone in self.stretches(self.over..over) {
            let asleep: Vec<Particle> = gone.clone().map(|i| self.dormant(i)).collect();
            gpu.write(particles, gone.start, &asleep)?;
        }
        let mut next = self.next;
        let last = self.emission.end.min(time + length);
        while next - over < room && self.emission.due(next) < last {
            next += 1;
        }
        let mut number = self.next;
        for fresh in self.stretches(self.next..next) {
            let (mut moving, mut shapes) = (Vec::new(), Vec::new());
            for slot in fresh.clone() {
                let (mut p, d) = self.start[(slot - self.pool.start) as usize];
                let early = (self.emission.due(number) - time) as f32;
                p.x = std::array::from_fn(|a| p.x[a] - p.v[a] * early);
                moving.push(p);
                shapes.push(d);
                number += 1;
            }
            gpu.write(particles, fresh.start, &moving)?;
            gpu.write(deformations, fresh.start, &shapes)?;
        }
        let (came, changed) = ((next - self.next) as u32, next > self.next || over > self.over);
        (self.next, self.over) = (next, over);
        Ok((came, changed))
    }

    fn dormant(&self, slot: u64) -> Particle {
        let (p, _) = self.start[(slot - self.pool.start) as usize];
        Particle { tag: p.tag | DORMANT | QUARANTINED, ..p }
    }
}

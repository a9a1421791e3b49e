//! Emitters: an object's particles leave its source layer by layer, as out of a nozzle, and return to the pool when their
//! life is over. Runs on the host between frames; particles not emitted cost nothing there and nothing on the device.

use std::ops::Range;

use physvideo_gpu::kernels::{Deformation, Particle};
use physvideo_gpu::{Buf, Gpu, GpuError};

use super::solver::{DORMANT, LED, QUARANTINED};
use crate::scene::Material;
use crate::world::{Emission, World};

/// The emitter of one body.
#[derive(Clone, Debug)]
pub struct Emitter {
    /// Its body.
    pub body: usize,
    emission: Emission,
    /// Its particles in the buffer.
    pool: Range<u64>,
    /// A copy of them as they leave, at the nozzle; the pool has one copy after another.
    start: Vec<(Particle, Deformation)>,
    /// Emitted so far.
    next: u64,
    places: Places,
}

/// Which places of a pool are in use.
#[derive(Clone, Debug)]
enum Places {
    /// Particles live equally long, so it is a ring: how many lives are over.
    Ring(u64),
    /// They come back when the device says so: whether each is out.
    Drained(Vec<bool>),
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
            let copy = pool.start..pool.start + emission.delays.len();
            let mut start: Vec<_> =
                particles[copy.clone()].iter().copied().zip(deformations[copy].iter().copied()).collect();
            if matches!(b.material, Material::Sph { .. }) {
                start.iter_mut().for_each(|(p, _)| p.tag |= LED);
            }
            for p in &mut particles[pool.clone()] {
                p.tag |= DORMANT | QUARANTINED;
            }
            let drains = b.recycle.is_some_and(|r| r.drains != 0);
            let places = if drains { Places::Drained(vec![false; pool.len()]) } else { Places::Ring(0) };
            let pool = pool.start as u64..pool.end as u64;
            found.push(Self { body, emission, pool, start, next: 0, places });
        }
        found
    }

    fn room(&self) -> u64 {
        self.pool.end - self.pool.start
    }

    /// Speed at which its particles leave [m/s].
    pub fn speed(&self) -> f32 {
        self.start.first().map_or(0.0, |(p, _)| p.v.iter().map(|c| c * c).sum::<f32>().sqrt())
    }

    /// Stretches of the buffer with its particles that are out.
    pub fn out(&self) -> Vec<Range<u64>> {
        match &self.places {
            Places::Ring(over) => self.stretches((*over..self.next).map(|n| n % self.room())),
            Places::Drained(out) => self.stretches((0..).zip(out).filter(|(_, out)| **out).map(|(place, _)| place)),
        }
    }

    /// Places of the pool as stretches of the buffer.
    fn stretches(&self, places: impl Iterator<Item = u64>) -> Vec<Range<u64>> {
        let mut found: Vec<Range<u64>> = Vec::new();
        for at in places.map(|place| self.pool.start + place) {
            match found.last_mut() {
                Some(last) if last.end == at => last.end += 1,
                _ => found.push(at..at + 1),
            }
        }
        found
    }

    /// Lets out what is due within `length` [s] of `time` [s], takes back what has lived long enough by `time` or was
    /// drained. Particles stand as far behind the nozzle as they need to reach it when they are due, so a jet has no gaps
    /// whatever the length of a frame. Returns how many came out, and whether any particle came or went.
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
        let gone = self.retire(gpu, particles, time)?;
        let last = self.emission.end.min(time + length);
        let (room, each) = (self.room(), self.start.len() as u64);
        let free: Vec<u64> = match &self.places {
            Places::Ring(over) => (self.next..over + room).map(|n| n % room).collect(),
            Places::Drained(out) => (0..room).zip(out).filter(|(_, out)| !**out).map(|(place, _)| place).collect(),
        };
        let due = free.into_iter().zip(self.next..).take_while(|(_, number)| self.emission.due(*number) < last);
        let fresh: Vec<(u64, u64)> = due.collect();
        let mut number = self.next;
        for run in self.stretches(fresh.iter().map(|(place, _)| *place)) {
            let (mut moving, mut shapes) = (Vec::new(), Vec::new());
            for _ in run.clone() {
                let (mut p, d) = self.start[(number % each) as usize];
                let early = (self.emission.due(number) - time) as f32;
                p.x = std::array::from_fn(|a| p.x[a] - p.v[a] * early);
                moving.push(p);
                shapes.push(d);
                number += 1;
            }
            gpu.write(particles, run.start, &moving)?;
            gpu.write(deformations, run.start, &shapes)?;
        }
        if let Places::Drained(out) = &mut self.places {
            fresh.iter().for_each(|(place, _)| out[*place as usize] = true);
        }
        self.next = number;
        Ok((fresh.len() as u32, gone || !fresh.is_empty()))
    }

    /// Takes back what has lived long enough, or finds what was drained; whether there was any.
    fn retire(&mut self, gpu: &Gpu, particles: Buf<Particle>, time: f64) -> Result<bool, GpuError> {
        let room = self.room();
        match &mut self.places {
            Places::Ring(over) => {
                let lasts = self.emission.lifetime.unwrap_or(f64::INFINITY);
                let before = *over;
                while *over < self.next && self.emission.due(*over) + lasts <= time {
                    *over += 1;
                }
                let gone = before..*over;
                let any = !gone.is_empty();
                for run in self.stretches(gone.map(|n| n % room)) {
                    let mut its = gpu.read_range(particles, run.start, run.end - run.start)?;
                    its.iter_mut().for_each(|p| p.tag |= DORMANT | QUARANTINED);
                    gpu.write(particles, run.start, &its)?;
                }
                Ok(any)
            }
            Places::Drained(out) if out.contains(&true) => {
                let now = gpu.read_range(particles, self.pool.start, room)?;
                let mut any = false;
                for (out, p) in out.iter_mut().zip(&now) {
                    any |= *out && p.tag & DORMANT != 0;
                    *out &= p.tag & DORMANT == 0;
                }
                Ok(any)
            }
            Places::Drained(_) => Ok(false),
        }
    }
}

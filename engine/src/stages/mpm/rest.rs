//! Blocks of the grid in which nothing moves are left out until something comes near. Knows boxes around what is in a
//! block, and neither nodes nor stress.
//!
//! A block is quiet when for half a second its fastest particle has moved by less than a hundredth of a cell a frame — a
//! hundredth in all that time where its material flows, since that adds up where swings do not — and the box around its
//! particles by less than a hundredth. It sleeps unless one that is not quiet can come near within the frame. Those asleep
//! beside one awake go on giving mass and stress to the nodes they share; all others are not touched at all. Those awake
//! beside one asleep are quiet and watched: where motion comes as far as them, the frame is repeated with more awake.

use std::collections::BTreeMap;
use std::ops::Range;

use physvideo_gpu::kernels::family::{field, shape};
use physvideo_gpu::kernels::{Collider, Extent, Field, Grid};

use super::reach::{Blocks, spread};
use crate::cap;
use crate::stages::solver::{ASLEEP, Nap, WATCHED};
use crate::world::World;

/// How long a block has to be quiet [s].
const QUIET: f64 = 0.5;
/// And how many frames at the least.
const FRAMES: u32 = 4;
/// Motion that nobody sees [cells].
const STILL: f32 = 0.01;
/// Motion in a frame that wakes what is beside it [cells]; twice the above, so that what has just become quiet does not.
pub(super) const STIR: f32 = 0.02;
/// How near is near [cells]: nodes reach half as far.
const NEAR: f32 = 3.0;
/// Block of a particle that was not seen yet, and of one in quarantine.
const UNSEEN: u32 = u32::MAX - 1;
const NOWHERE: u32 = u32::MAX;

/// A box with sides along the axes [m].
#[derive(Clone, Copy, Debug, PartialEq)]
struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    /// Distance to another, 0 where they overlap.
    fn gap(&self, other: &Self) -> f32 {
        let along = |a: usize| (self.low[a] - other.high[a]).max(other.low[a] - self.high[a]).max(0.0);
        (0..3).map(|a| along(a) * along(a)).sum::<f32>().sqrt()
    }

    /// Largest distance between corners of the same name.
    fn moved(&self, other: &Self) -> f32 {
        let along = |a: usize| (self.low[a] - other.low[a]).abs().max((self.high[a] - other.high[a]).abs());
        (0..3).map(along).fold(0.0, f32::max)
    }
}

/// What is known of a block that holds particles.
#[derive(Clone, Debug)]
struct Block {
    bounds: Bounds,
    speed: f32,
    /// Where its particles were when it became quiet, and for how many frames and seconds it has been.
    since: Option<(Bounds, u32, f64)>,
    /// What is said of any body in it.
    habits: Habits,
}

impl Block {
    fn quiet(&self) -> bool {
        self.since.is_some_and(|(_, frames, s)| frames >= FRAMES && s >= QUIET)
    }

    /// Takes in where its particles are, and for how long they have been quiet.
    fn look(&mut self, now: Bounds, length: f32, dx: f32) {
        let while_counting = if self.habits.flows { length.max(QUIET as f32) } else { length };
        let slow = self.speed * while_counting < STILL * dx && !self.habits.busy;
        self.bounds = now;
        self.since = match self.since {
            _ if !slow => None,
            Some((then, frames, s)) if now.moved(&then) < STILL * dx => Some((then, frames + 1, s + f64::from(length))),
            _ => Some((now, 0, 0.0)),
        };
    }
}

/// What rest depends on in a body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Habits {
    /// Never left out: its particles come and go.
    busy: bool,
    flows: bool,
    fields: u32,
}

impl Habits {
    fn with(&mut self, other: &Self) {
        self.busy |= other.busy;
        self.flows |= other.flows;
        self.fields |= other.fields;
    }
}

/// What a block does in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// Its particles are worked on.
    Awake,
    /// The same, and motion in it wakes those beside it.
    Watched,
    /// They only give to the grid.
    Lends,
    /// They are left out.
    Out,
}

/// Which blocks are asleep.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    on: bool,
    place: Blocks,
    blocks: BTreeMap<u32, Block>,
    /// Of each block of the grid.
    states: Vec<State>,
    bodies: Vec<Habits>,
    /// Where particles come up from time to time, and how fast they can be [m/s].
    sources: Vec<(u32, f32)>,
    /// Body and block of each particle.
    body_of: Vec<u8>,
    homes: Vec<u32>,
    /// Particles of each body that sleep.
    asleep: Vec<u32>,
    naps: Vec<Vec<Nap>>,
    /// Blocks by which everything in motion reaches further, as the last frames have shown to be needed.
    further: u32,
    fields: Vec<Field>,
    colliders: Vec<Collider>,
    /// Largest gravity of a body, and what fields add to it at the most [m/s²].
    weight: f32,
}

impl Rest {
    pub fn new(world: &World, grid: &Grid, on: bool) -> Self {
        let size = |v: [f32; 3]| v.iter().map(|c| c * c).sum::<f32>().sqrt();
        let habits = |b: &crate::world::Body| Habits {
            busy: b.emission.is_some() || b.recycle.is_some(),
            flows: !b.material.elastic(),
            fields: b.fields,
        };
        let place = Blocks::of(grid);
        let particles = world.bodies.iter().map(|b| b.positions.len()).sum();
        Self {
            on,
            states: vec![State::Awake; place.count()],
            blocks: BTreeMap::new(),
            bodies: world.bodies.iter().map(habits).collect(),
            sources: world.bodies.iter().flat_map(|b| sources(b, &place)).collect(),
            place,
            body_of: (0..).zip(&world.bodies).flat_map(|(i, b)| b.positions.iter().map(move |_| i)).collect(),
            homes: vec![UNSEEN; particles],
            asleep: vec![0; world.bodies.len()],
            naps: vec![Vec::new(); world.bodies.len()],
            further: 0,
            fields: world.fields.clone(),
            colliders: world.colliders.clone(),
            weight: world.bodies.iter().map(|b| size(b.gravity.unwrap_or(world.gravity))).fold(0.0, f32::max)
                + world.fields.iter().map(|f| cap::push(f, world) + cap::wind_drag(f) * cap::wind(f)).sum::<f64>()
                    as f32,
        }
    }

    /// Whether anything is ever left out.
    pub fn on(&self) -> bool {
        self.on
    }

    /// Particles that sleep.
    pub fn asleep(&self) -> u32 {
        self.asleep.iter().sum()
    }

    /// When particles of each body were left out, up to `now` [s].
    pub fn naps(&self, now: f64) -> Vec<Vec<Nap>> {
        let ended = |nap: &Nap| Nap { to: nap.to.min(now), ..*nap };
        self.naps.iter().map(|its| its.iter().map(ended).collect()).collect()
    }

    /// Chooses who sleeps in a frame of `length` [s] from `time` [s] on.
    pub fn decide(&mut self, time: f64, length: f32) {
        self.states.fill(State::Awake);
        let stirred: Vec<u32> =
            self.blocks.iter().filter(|(_, b)| self.disturbed(b, time, length)).map(|(at, _)| *at).collect();
        for at in stirred {
            if let Some(block) = self.blocks.get_mut(&at) {
                block.since = None;
            }
        }
        if self.blocks.values().all(|b| !b.quiet()) {
            return;
        }
        let dx = self.place.dx;
        let reach = |speed: f32| {
            let travel = (speed + 0.5 * self.weight * length) * length;
            // More than a grid holds is as good as all of it.
            self.further.saturating_add(((NEAR + travel / dx) / 4.0).ceil() as u32)
        };
        let restless = self.blocks.iter().filter(|(_, b)| !b.quiet()).map(|(at, b)| (*at, reach(b.speed)));
        let sources = self.sources.iter().map(|(at, speed)| (*at, reach(*speed)));
        let awake = spread(&self.place, restless.chain(sources));
        for at in self.blocks.keys() {
            let beside = |is_awake: bool| {
                let occupied = |n: &usize| self.blocks.contains_key(&(*n as u32));
                self.place.around(*at).filter(occupied).any(|n| awake[n] == is_awake)
            };
            self.states[*at as usize] = match awake[*at as usize] {
                true if beside(false) => State::Watched,
                true => State::Awake,
                false if beside(true) => State::Lends,
                false => State::Out,
            };
        }
    }

    /// Motion has come to what was watched: more is to be awake.
    pub fn reach_further(&mut self) {
        self.further = self.further.saturating_mul(2).saturating_add(1);
    }

    /// What is set in the particles' tags, for each block of the grid; absent where all are awake.
    pub fn flags(&self) -> Option<Vec<u32>> {
        let flag = |s: &State| match s {
            State::Awake => 0,
            State::Watched => WATCHED,
            State::Lends | State::Out => ASLEEP,
        };
        self.states.iter().any(|s| *s != State::Awake).then(|| self.states.iter().map(flag).collect())
    }

    /// The particles that are worked on; of those whose bodies emit them, `out` are there.
    pub fn list(&mut self, ranges: &[Range<u64>], out: impl Fn(usize) -> Option<Vec<Range<u64>>>) -> Vec<u32> {
        let mut listed = Vec::new();
        for (body, range) in ranges.iter().enumerate() {
            self.asleep[body] = 0;
            if let Some(out) = out(body) {
                listed.extend(out.into_iter().flat_map(|r| r.start as u32..r.end as u32));
                continue;
            }
            for p in range.start as u32..range.end as u32 {
                let state = self.homes.get(p as usize).and_then(|home| self.states.get(*home as usize));
                self.asleep[body] += u32::from(matches!(state, Some(State::Lends | State::Out)));
                if state != Some(&State::Out) {
                    listed.push(p);
                }
            }
        }
        listed
    }

    /// Takes in what was seen after a frame of `length` [s] that ended at `time` [s]: the particles that were worked on,
    /// the cell of each of all (block · 64 + cell), and the blocks that hold the former.
    pub fn look(&mut self, listed: &[u32], keys: &[u32], seen: &[(u32, Extent)], time: f64, length: f32) {
        let mut habits: BTreeMap<u32, Habits> = BTreeMap::new();
        let mut last = (NOWHERE, Habits::default());
        for p in listed.iter().map(|p| *p as usize) {
            self.homes[p] = if keys[p] == NOWHERE { NOWHERE } else { keys[p] / 64 };
            let here = (self.homes[p], self.bodies[usize::from(self.body_of[p])]);
            // Most have the block and the body of the one before.
            if here != last {
                habits.entry(here.0).or_default().with(&here.1);
                last = here;
            }
        }
        let dx = self.place.dx;
        let mut blocks = std::mem::take(&mut self.blocks);
        for (at, extent) in seen.iter().filter(|(_, e)| e.seen != 0) {
            let now = Bounds { low: extent.low.map(|k| -float(k)), high: extent.high.map(float) };
            let since = blocks.remove(at).and_then(|b| b.since);
            let habits = habits.get(at).copied().unwrap_or_default();
            let mut block = Block { bounds: now, speed: f32::from_bits(extent.speed), since, habits };
            block.look(now, length, dx);
            self.blocks.insert(*at, block);
        }
        // Of the others, those that were left out are as they were, and the rest is empty now.
        let states = &self.states;
        self.blocks.extend(blocks.into_iter().filter(|(at, _)| states[*at as usize] == State::Out));
        self.remember(time, length);
        self.further /= 2;
    }

    /// Writes down who slept in the frame of `length` [s] that ended at `time` [s].
    pub fn remember(&mut self, time: f64, length: f32) {
        for (naps, count) in self.naps.iter_mut().zip(&self.asleep).filter(|(_, count)| **count > 0) {
            let began = time - f64::from(length);
            match naps.last_mut() {
                // Ends of frames add up to the same times but for rounding.
                Some(nap) if nap.to > began - 1e-3 * f64::from(length) => {
                    (nap.to, nap.particles) = (time, nap.particles.max(*count));
                }
                _ => naps.push(Nap { from: began, to: time, particles: *count }),
            }
        }
    }

    /// Whether a field or an obstacle in motion acts on a block within a frame.
    fn disturbed(&self, block: &Block, time: f64, length: f32) -> bool {
        let bounds = &block.bounds;
        let (from, to) = (time as f32, time as f32 + length);
        let acts = |(bit, f): (usize, &Field)| {
            let there = match f.region {
                1 => bounds.gap(&Bounds { low: three(f.region_min), high: three(f.region_max) }) <= 0.0,
                2 => bounds.gap(&at(three(f.region_min))) <= f.region_max[0],
                _ => true,
            };
            let on = block.habits.fields >> bit & 1 == 1 && from < f.end && to >= f.start;
            // Damping does nothing to what rests.
            on && there && f.kind != field::DAMPING
        };
        let meets = |c: &Collider| {
            let size = three(c.size).iter().map(|s| s * s).sum::<f32>().sqrt();
            let norm = |v: [f32; 4]| three(v).iter().map(|s| s * s).sum::<f32>().sqrt();
            let speed = norm(c.velocity) + norm(c.spin) * size;
            let moves = speed > 0.0 && from < c.end && to >= c.start;
            let moving = from.clamp(c.start, c.end) - c.start;
            let center: [f32; 3] = std::array::from_fn(|a| c.center[a] + c.velocity[a] * moving);
            let bounded = c.shape == shape::BALL || c.shape == shape::BOX;
            moves && (!bounded || bounds.gap(&at(center)) < size + speed * length + NEAR * self.place.dx)
        };
        self.fields.iter().enumerate().any(acts) || self.colliders.iter().any(meets)
    }
}

/// Blocks where particles of a body come up from time to time: those of its nozzle, and of where it starts anew.
fn sources(body: &crate::world::Body, place: &Blocks) -> Vec<(u32, f32)> {
    let size = |v: &[f32]| v[..3].iter().map(|c| c * c).sum::<f32>().sqrt();
    let fastest = body.velocities.iter().map(|v| size(v)).fold(0.0, f32::max);
    let nozzle = body.emission.iter().flat_map(|_| &body.positions).filter_map(|x| place.at(*x));
    let mut found: Vec<(u32, f32)> = nozzle.map(|at| (at, fastest)).collect();
    if let Some(r) = &body.recycle {
        let speed = size(&r.velocity);
        found.extend(place.within(three(r.source_min), three(r.source_max)).map(|at| (at, speed)));
    }
    found.sort_by_key(|s| s.0);
    found.dedup();
    found
}

fn three(v: [f32; 4]) -> [f32; 3] {
    [v[0], v[1], v[2]]
}

fn at(point: [f32; 3]) -> Bounds {
    Bounds { low: point, high: point }
}

/// The float that a `key` of `mpm/survey` stands for.
fn float(key: u32) -> f32 {
    f32::from_bits(key ^ if key >> 31 == 1 { 0x8000_0000 } else { 0xffff_ffff })
}

//! Bodies at rest that nothing touches are left out until something comes near. Knows boxes around bodies, and neither
//! grid nor stress.
//!
//! A body falls asleep when for half a second it has moved by less than a hundredth of a cell a frame — a hundredth in all
//! that time where its material flows, since that adds up where swings do not — and its box by less than a hundredth. It
//! sleeps only together with all that is within a block of it. Its state stays as it is, so it goes on as it was.

use physvideo_gpu::kernels::family::{field, shape};
use physvideo_gpu::kernels::{Collider, Extent, Field};

use crate::world::World;

/// How long a body has to be quiet [s].
const QUIET: f64 = 0.5;
/// And how many frames at the least.
const FRAMES: u32 = 4;
/// Motion that nobody sees [cells].
const STILL: f32 = 0.01;
/// How near is near [cells]: a block.
const NEAR: f32 = 4.0;

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

    /// The box around both.
    fn with(&self, other: &Self) -> Self {
        let each = |of: fn(f32, f32) -> f32, a: [f32; 3], b: [f32; 3]| std::array::from_fn(|i| of(a[i], b[i]));
        Self { low: each(f32::min, self.low, other.low), high: each(f32::max, self.high, other.high) }
    }

    /// Largest distance between corners of the same name.
    fn moved(&self, other: &Self) -> f32 {
        let along = |a: usize| (self.low[a] - other.low[a]).abs().max((self.high[a] - other.high[a]).abs());
        (0..3).map(along).fold(0.0, f32::max)
    }
}

/// What is known of a body.
#[derive(Clone, Debug)]
struct Body {
    /// Never left out: its particles come and go.
    busy: bool,
    flows: bool,
    fields: u32,
    /// Where its particles may come up anew, wherever the others are.
    home: Option<Bounds>,
    /// Size of its gravity [m/s²].
    weight: f32,
    bounds: Option<Bounds>,
    speed: f32,
    /// Where it was when it became quiet, and for how many frames and seconds it has been.
    since: Option<(Bounds, u32, f64)>,
    /// When it fell asleep and when it woke [s]; the last may not have ended.
    naps: Vec<(f64, Option<f64>)>,
}

impl Body {
    fn asleep(&self) -> bool {
        self.naps.last().is_some_and(|nap| nap.1.is_none())
    }
}

/// Which bodies are asleep.
#[derive(Clone, Debug)]
pub(super) struct Rest {
    on: bool,
    bodies: Vec<Body>,
    fields: Vec<Field>,
    colliders: Vec<Collider>,
    dx: f32,
}

impl Rest {
    pub fn new(world: &World, on: bool) -> Self {
        let body = |b: &crate::world::Body| Body {
            busy: b.emission.is_some() || b.recycle.is_some(),
            flows: !b.material.elastic(),
            fields: b.fields,
            home: home(b),
            weight: b.gravity.unwrap_or(world.gravity).iter().map(|c| c * c).sum::<f32>().sqrt(),
            bounds: home(b),
            speed: 0.0,
            since: None,
            naps: Vec::new(),
        };
        Self {
            on,
            bodies: world.bodies.iter().map(body).collect(),
            fields: world.fields.clone(),
            colliders: world.colliders.clone(),
            dx: world.dx,
        }
    }

    /// Whether anything is ever left out.
    pub fn on(&self) -> bool {
        self.on
    }

    pub fn asleep(&self, body: usize) -> bool {
        self.bodies[body].asleep()
    }

    pub fn count(&self) -> u32 {
        self.bodies.iter().filter(|b| b.asleep()).count() as u32
    }

    /// From when to when each body was left out [s], up to `now`.
    pub fn naps(&self, now: f64) -> Vec<Vec<[f64; 2]>> {
        let of = |b: &Body| b.naps.iter().map(|(from, to)| [*from, to.unwrap_or(now)]).collect();
        self.bodies.iter().map(of).collect()
    }

    /// Wakes whom something will reach in a frame of `length` [s] from `time` [s] on; their numbers.
    pub fn wake(&mut self, time: f64, length: f32) -> Vec<usize> {
        let mut woken = Vec::new();
        loop {
            let due = |i: &usize| {
                self.asleep(*i) && (self.disturbed(*i, time, length) || self.near_one_awake(*i, length, |_| true))
            };
            let next: Vec<usize> = (0..self.bodies.len()).filter(due).collect();
            if next.is_empty() {
                return woken;
            }
            for i in &next {
                self.bodies[*i].since = None;
                if let Some(nap) = self.bodies[*i].naps.last_mut() {
                    nap.1 = Some(time);
                }
            }
            woken.extend(next);
        }
    }

    /// Takes in what was seen after a frame of `length` [s] that ended at `time` [s], and lets fall asleep who may; their
    /// numbers.
    pub fn settle(&mut self, extents: &[Extent], time: f64, length: f32) -> Vec<usize> {
        for (body, extent) in self.bodies.iter_mut().zip(extents).filter(|(b, _)| !b.asleep()) {
            body.look(extent, length, self.dx);
        }
        let may = |i: &usize| {
            let b = &self.bodies[*i];
            let quiet = b.since.is_some_and(|(_, frames, s)| frames >= FRAMES && s >= QUIET);
            quiet && !b.asleep() && !b.busy && !self.disturbed(*i, time, length)
        };
        let mut tired: Vec<usize> = (0..self.bodies.len()).filter(may).collect();
        // Who has a neighbour that stays awake stays awake.
        loop {
            let before = tired.len();
            let stays = |i: &usize| !self.near_one_awake(*i, length, |j| !tired.contains(&j));
            tired = tired.iter().copied().filter(stays).collect();
            if tired.len() == before {
                break;
            }
        }
        for i in &tired {
            self.bodies[*i].naps.push((time, None));
        }
        tired
    }

    /// Whether a body that is awake, and of which `counts` holds, may come near body `i` within a frame.
    fn near_one_awake(&self, i: usize, length: f32, counts: impl Fn(usize) -> bool) -> bool {
        let Some(mine) = self.bodies[i].bounds else { return true };
        let reaches = |(j, b): (usize, &Body)| {
            let travel = (b.speed + b.weight * length) * length;
            // One not seen yet could be anywhere.
            let near = b.bounds.is_none_or(|its| its.gap(&mine) < NEAR * self.dx + travel);
            j != i && !b.asleep() && counts(j) && near
        };
        self.bodies.iter().enumerate().any(reaches)
    }

    /// Whether a field or an obstacle in motion acts on body `i` within a frame.
    fn disturbed(&self, i: usize, time: f64, length: f32) -> bool {
        let body = &self.bodies[i];
        let Some(bounds) = body.bounds else { return true };
        let (from, to) = (time as f32, time as f32 + length);
        let acts = |(bit, f): (usize, &Field)| {
            let there = match f.region {
                1 => bounds.gap(&Bounds { low: three(f.region_min), high: three(f.region_max) }) <= 0.0,
                2 => bounds.gap(&at(three(f.region_min))) <= f.region_max[0],
                _ => true,
            };
            let on = body.fields >> bit & 1 == 1 && from < f.end && to >= f.start;
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
            moves && (!bounded || bounds.gap(&at(center)) < size + speed * length + NEAR * self.dx)
        };
        self.fields.iter().enumerate().any(acts) || self.colliders.iter().any(meets)
    }
}

impl Body {
    /// Takes in where it is, and for how long it has been quiet.
    fn look(&mut self, extent: &Extent, length: f32, dx: f32) {
        if extent.seen == 0 {
            return; // all of it is in quarantine
        }
        let now = Bounds { low: extent.low.map(|k| -float(k)), high: extent.high.map(float) };
        self.speed = f32::from_bits(extent.speed);
        self.bounds = Some(self.home.map_or(now, |home| home.with(&now)));
        let while_counting = if self.flows { length.max(QUIET as f32) } else { length };
        let slow = self.speed * while_counting < STILL * dx;
        self.since = match self.since {
            _ if !slow => None,
            Some((then, frames, s)) if now.moved(&then) < STILL * dx => Some((then, frames + 1, s + f64::from(length))),
            _ => Some((now, 0, 0.0)),
        };
    }
}

/// The source of what is emitted or starts anew.
fn home(body: &crate::world::Body) -> Option<Bounds> {
    let nozzle = body.emission.iter().flat_map(|_| &body.positions).map(|x| at(*x));
    let returns = body.recycle.map(|r| Bounds { low: three(r.source_min), high: three(r.source_max) });
    nozzle.chain(returns).reduce(|a, b| a.with(&b))
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

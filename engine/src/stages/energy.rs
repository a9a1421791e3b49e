//! How much energy a frame may end with, by what it began with and what can have come in: the guard behind steps that are
//! too long without anything running away. Knows the world and no solver.

use physvideo_gpu::kernels::family::field;
use physvideo_gpu::kernels::{Collider, Field};

use super::solver::Measure;
use crate::world::World;

/// Gain beyond all that can have come in, summed over frames less what they lose, as a share of the energy at hand. The
/// energies of particles lie half a step beside their velocities, so that those of waves a few cells long swing by
/// (ω dt/2)², a quarter at Courant 0.75; such waves carry little of a body's energy.
const SHARE: f64 = 0.1;
/// What every body may have besides, so that rest is no fault: the energy of a fall through this share of a cell ...
const FALL: f64 = 0.05;
/// ... and of moving at this share of its slowest wave's speed.
const MACH: f64 = 1e-3;

/// What fields can bring, and what else there is to know of a world's energy.
#[derive(Clone, Debug)]
pub struct Budget {
    sources: Vec<Source>,
    colliders: Vec<Collider>,
    /// Its particles start anew, with energy that nobody counts.
    recycles: bool,
    /// Energy that counts as rest [J].
    floor: f64,
    /// Gain so far that nothing explains [J].
    spent: f64,
}

/// A field that can bring energy.
#[derive(Clone, Copy, Debug)]
struct Source {
    start: f64,
    end: f64,
    /// Largest acceleration times √(M/2), M the mass it acts on: the most by which the root of the energy can grow [√J/s].
    root: f64,
    /// Largest power [W].
    power: f64,
}

impl Source {
    /// Power is Σ m a·v ≤ a √(2 M X), so √X grows by at most a √(M/2). Drag k towards an air that moves at w gives
    /// m k (w − v)·v ≤ m k w²/4.
    fn new(f: &Field, mass: f64, highest: f64) -> Self {
        let size = |v: [f32; 4]| v[..3].iter().map(|c| f64::from(c * c)).sum::<f64>().sqrt();
        let (p0, p1) = (f64::from(f.p0), f64::from(f.p1));
        let (acceleration, power) = match f.kind {
            field::UNIFORM | field::POINT => (size(f.a), 0.0),
            field::VORTEX => (p0.abs(), 0.0),
            // Values of ±√3 with weights that sum to one, divided by the root of their squares' sum, at least 1/16.
            field::NOISE => {
                let grown = p0.max(p0 + p1 * (highest - f64::from(f.p2)));
                (48f64.sqrt() * grown.max(0.0) * size(f.a), 0.0)
            }
            field::WIND => (0.0, 0.25 * mass * p0 * (size(f.a) * (1.0 + p1.abs())).powi(2)),
            _ => (0.0, 0.0),
        };
        Self { start: f.start.into(), end: f.end.into(), root: acceleration * (0.5 * mass).sqrt(), power }
    }
}

impl Budget {
    /// What a world's fields can bring.
    pub fn new(world: &World) -> Self {
        let mass = |b: &crate::world::Body| f64::from(b.density * b.particle_volume) * b.positions.len() as f64;
        let all: f64 = world.bodies.iter().map(mass).sum();
        let source = |(i, f): (usize, &Field)| {
            let touched = world.bodies.iter().filter(|b| b.fields & (1 << i) != 0).map(mass).sum();
            Source::new(f, touched, world.domain.1[2].into())
        };
        let gravity = world.bodies.iter().map(|b| b.gravity.unwrap_or(world.gravity));
        let pull = gravity.map(|g| g.iter().map(|c| f64::from(c * c)).sum::<f64>().sqrt()).fold(0.0, f64::max);
        let slowest = f64::from(world.wave_speeds().0);
        Self {
            sources: world.fields.iter().enumerate().map(source).collect(),
            colliders: world.colliders.clone(),
            recycles: world.bodies.iter().any(|b| b.recycle.is_some()),
            floor: all * (FALL * pull * f64::from(world.dx) + 0.5 * (MACH * slowest).powi(2)),
            spent: 0.0,
        }
    }

    /// Whether the frame of `length` seconds from `time` can be judged: obstacles in motion and particles that start anew
    /// bring what is not counted.
    pub fn judges(&self, time: f64, length: f64) -> bool {
        let runs = |start: f32, end: f32| f64::from(start) < time + length && f64::from(end) > time;
        let moves = |c: &Collider| (c.velocity, c.spin) != ([0.0; 4], [0.0; 4]) && runs(c.start, c.end);
        !self.recycles && !self.colliders.iter().any(moves)
    }

    /// Whether a frame may end so: it began with `before` and ends with `after`, sums over all bodies. One that may is
    /// remembered.
    pub fn allows(&mut self, before: &Measure, after: &Measure, time: f64, length: f64) -> bool {
        let (mut root, mut power) = (0.0, 0.0);
        for s in self.sources.iter().filter(|s| s.start < time + length && s.end > time) {
            (root, power) = (root + s.root, power + s.power);
        }
        let (x0, x1) = (before.energy(), after.energy());
        let fallen = before.potential - after.potential;
        let most = ((x0 + fallen + power * length).max(0.0).sqrt() + root * length).powi(2);
        let spent = (self.spent + x1 - most).max(0.0);
        let fits = spent <= SHARE * x1.min(most) + self.floor;
        if fits {
            self.spent = spent;
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budget(fields: &[Field]) -> Budget {
        let sources = fields.iter().map(|f| Source::new(f, 2.0, 1.0)).collect();
        Budget { sources, colliders: vec![], recycles: false, floor: 1e-6, spent: 0.0 }
    }

    fn of(kinetic: f64, potential: f64) -> Measure {
        Measure { kinetic, potential, ..Default::default() }
    }

    #[test]
    fn a_fall_pays_for_itself() {
        assert!(budget(&[]).allows(&of(1.0, 5.0), &of(3.0, 3.0), 0.0, 0.1));
        assert!(!budget(&[]).allows(&of(1.0, 5.0), &of(3.0, 4.0), 0.0, 0.1));
    }

    /// 2 kg at 4 m/s, pushed at 3 m/s² for 0.5 s, end at 5.5 m/s; the same push is over in the next second.
    #[test]
    fn a_push_brings_what_it_can() {
        let push = Field { kind: field::UNIFORM, end: 0.5, a: [0.0, 3.0, 0.0, 0.0], ..Default::default() };
        let (before, after) = (of(16.0, 0.0), of(5.5f64.powi(2), 0.0));
        assert!(budget(&[push]).allows(&before, &after, 0.0, 0.5));
        assert!(!budget(&[push]).allows(&before, &of(1.2 * after.kinetic, 0.0), 0.0, 0.5));
        assert!(!budget(&[push]).allows(&before, &after, 1.0, 0.5));
    }

    /// The root of the energy grows fastest where drag meets half the air's speed: k m w²/4 of power.
    #[test]
    fn wind_brings_what_it_can() {
        let wind = Field { kind: field::WIND, end: 9.0, p0: 2.0, a: [4.0, 0.0, 0.0, 0.0], ..Default::default() };
        let slowly = |kinetic| budget(&[wind]).allows(&of(4.0, 0.0), &of(kinetic, 0.0), 0.0, 0.01);
        assert!(slowly(4.16) && !slowly(5.0));
    }

    #[test]
    fn small_gains_add_up() {
        let mut budget = budget(&[]);
        let grown: Vec<bool> =
            (0..4).map(|i| budget.allows(&of(1.04f64.powi(i), 0.0), &of(1.04f64.powi(i + 1), 0.0), 0.0, 0.1)).collect();
        assert_eq!(grown, [true, true, false, false]);
        // What swings back and forth does not.
        let mut budget = super::tests::budget(&[]);
        assert!((0..20).all(|_| budget.allows(&of(1.0, 0.0), &of(1.06, 0.0), 0.0, 0.1)
            && budget.allows(&of(1.06, 0.0), &of(1.0, 0.0), 0.0, 0.1)));
    }

    #[test]
    fn what_moves_obstacles_is_not_judged() {
        let wall = Collider { end: 1.0, velocity: [1.0, 0.0, 0.0, 0.0], ..Default::default() };
        let moved = Budget { colliders: vec![wall], ..budget(&[]) };
        assert!(!moved.judges(0.9, 0.2) && moved.judges(1.0, 0.2) && budget(&[]).judges(0.0, 1.0));
        assert!(!Budget { recycles: true, ..budget(&[]) }.judges(0.0, 1.0));
    }
}

//! How much energy a frame may end with, by what it began with and what can have come in: the guard behind steps that are
//! too long without anything running away. Knows the world and no solver.

use physvideo_gpu::kernels::family::field;
use physvideo_gpu::kernels::{Clock, Collider, Field, Particle};

use super::solver::{BODY, DORMANT, Measure, QUARANTINED};
pub use crate::walls::moves;
use crate::world::World;

/// Gain beyond all that can have come in, summed over frames less what they lose, as a share of the energy at hand. The
/// energies of particles lie half a step beside their velocities, so that those of waves a few cells long swing by
/// (ω dt/2)², a quarter at Courant 0.75; such waves carry little of a body's energy.
const SHARE: f64 = 0.1;
/// The same where bodies on grids of their own touch matter of the shared one: the work of its springs is counted half a step
/// late, so that the sum is up to a seventh too high while they do (tests/lagrangian/mixed.rs).
const SHARE_BESIDE: f64 = 0.2;
/// What every body may have besides, so that rest is no fault: the energy of a fall through this share of a cell ...
const FALL: f64 = 0.05;
/// ... and of moving at this share of its slowest wave's speed.
const MACH: f64 = 1e-3;
/// [m/s²]
const EARTH: f64 = 9.81;

/// What fields can bring, and what else there is to know of a world's energy.
#[derive(Clone, Debug)]
pub struct Budget {
    sources: Vec<Source>,
    /// What pulls each body [m/s²].
    gravity: Vec<[f32; 3]>,
    /// Largest speed of an obstacle within the domain [m/s].
    swiftest: f64,
    /// Of all bodies [kg].
    mass: f64,
    /// Energy that counts as rest [J].
    floor: f64,
    /// Gain so far that nothing explains [J].
    spent: f64,
    /// How much of that may be, of the energy at hand.
    share: f64,
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

/// Largest speed of an obstacle that spins within a domain, low and high corner [m/s].
fn swiftest(c: &Collider, domain: ([f32; 3], [f32; 3])) -> f64 {
    let size = |v: &[f32]| v.iter().map(|c| f64::from(c * c)).sum::<f64>().sqrt();
    let across: [f32; 3] = std::array::from_fn(|a| domain.1[a] - domain.0[a]);
    size(&c.velocity[..3]) + size(&c.spin[..3]) * size(&across)
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
        let cell = if world.is_fluid() { world.fluid.particle_size } else { world.dx };
        // Particles without order find theirs, whatever pulls.
        let pull = if world.is_fluid() { pull.max(EARTH) } else { pull };
        // A surface that shrinks gives what nobody counts: no more than that of drops of six particles across.
        let tension = |b: &crate::world::Body| f64::from(b.surface_tension() / (b.density * cell));
        let taut: f64 = world.bodies.iter().map(|b| mass(b) * tension(b)).sum();
        Self {
            sources: world.fields.iter().enumerate().map(source).collect(),
            swiftest: world.colliders.iter().map(|c| swiftest(c, world.domain)).fold(0.0, f64::max),
            gravity: world.bodies.iter().map(|b| b.gravity.unwrap_or(world.gravity)).collect(),
            mass: all,
            floor: all * (FALL * pull * f64::from(cell) + 0.5 * (MACH * slowest).powi(2)) + taut,
            spent: 0.0,
            share: SHARE,
        }
    }

    /// The same where bodies on grids of their own are beside those of a shared one.
    pub fn beside(self) -> Self {
        Self { share: SHARE_BESIDE, ..self }
    }

    /// What one step of a count of work stands for [J], before a frame that begins with `before`: a part in 2³⁶ of what
    /// there is and of what the swiftest obstacle can make of it, so that f32 and 63 bits hold whatever may come.
    pub fn unit(&self, before: &Measure) -> f32 {
        let most = before.energy() + self.floor + 0.5 * self.mass * self.swiftest.powi(2);
        (most / f64::from(1 << 18).powi(2)).max(f64::from(f32::MIN_POSITIVE)) as f32
    }

    /// Energy in motion and in gravity, where they are now, of particles of `now` that have been taken out since `then` [J]:
    /// what leaves the domain takes it along.
    pub fn taken(&self, then: &[Particle], now: &[Particle]) -> f64 {
        let here = |p: &Particle| p.tag & QUARANTINED == 0;
        let went = then.iter().zip(now).filter(|(a, b)| here(a) && !here(b) && b.tag & DORMANT == 0);
        let dot = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).map(|(a, b)| f64::from(a * b)).sum::<f64>();
        let energy = |p: &Particle| {
            let gravity = self.gravity.get((p.tag & BODY) as usize).copied().unwrap_or_default();
            f64::from(p.m) * (0.5 * dot(p.v, p.v) - dot(gravity, p.x))
        };
        went.map(|(_, b)| energy(b)).filter(|e| e.is_finite()).sum()
    }

    /// The most energy in motion and deformation [J] with which a frame can end that began with `before`, if what is in
    /// gravity is as in `after` and `work` [J] came in from obstacles and with what started anew.
    pub fn most(&self, before: &Measure, after: &Measure, work: f64, time: f64, length: f64) -> f64 {
        let (mut root, mut power) = (0.0, 0.0);
        for s in self.sources.iter().filter(|s| s.start < time + length && s.end > time) {
            (root, power) = (root + s.root, power + s.power);
        }
        let fallen = before.potential - after.potential;
        ((before.energy() + fallen + work + power * length).max(0.0).sqrt() + root * length).powi(2)
    }

    /// Whether a frame may end so: it began with `before` and ends with `after`, sums over all bodies, and `work` [J] came
    /// in from obstacles and with what started anew. One that may is remembered.
    pub fn allows(&mut self, before: &Measure, after: &Measure, work: f64, time: f64, length: f64) -> bool {
        let (most, x1) = (self.most(before, after, work, time, length), after.energy());
        let spent = (self.spent + x1 - most).max(0.0);
        // What loses energy is not at fault, whatever came before.
        let fits = spent <= self.share * x1.min(most) + self.floor || x1 <= most;
        if fits {
            self.spent = spent;
        }
        fits
    }
}

/// Energy that came in from obstacles and with what started anew, as the device has counted it [J].
pub fn work(clock: &Clock) -> f64 {
    let units = (u64::from(clock.work_high) << 32 | u64::from(clock.work_low)) as i64;
    units as f64 * f64::from(clock.work_unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn budget(fields: &[Field]) -> Budget {
        let sources = fields.iter().map(|f| Source::new(f, 2.0, 1.0)).collect();
        Budget { sources, gravity: vec![], swiftest: 0.0, mass: 2.0, floor: 1e-6, spent: 0.0, share: SHARE }
    }

    fn of(kinetic: f64, potential: f64) -> Measure {
        Measure { kinetic, potential, ..Default::default() }
    }

    #[test]
    fn a_fall_pays_for_itself() {
        assert!(budget(&[]).allows(&of(1.0, 5.0), &of(3.0, 3.0), 0.0, 0.0, 0.1));
        assert!(!budget(&[]).allows(&of(1.0, 5.0), &of(3.0, 4.0), 0.0, 0.0, 0.1));
    }

    /// 2 kg at 4 m/s, pushed at 3 m/s² for 0.5 s, end at 5.5 m/s; the same push is over in the next second.
    #[test]
    fn a_push_brings_what_it_can() {
        let push = Field { kind: field::UNIFORM, end: 0.5, a: [0.0, 3.0, 0.0, 0.0], ..Default::default() };
        let (before, after) = (of(16.0, 0.0), of(5.5f64.powi(2), 0.0));
        assert!(budget(&[push]).allows(&before, &after, 0.0, 0.0, 0.5));
        assert!(!budget(&[push]).allows(&before, &of(1.2 * after.kinetic, 0.0), 0.0, 0.0, 0.5));
        assert!(!budget(&[push]).allows(&before, &after, 0.0, 1.0, 0.5));
    }

    /// The root of the energy grows fastest where drag meets half the air's speed: k m w²/4 of power.
    #[test]
    fn wind_brings_what_it_can() {
        let wind = Field { kind: field::WIND, end: 9.0, p0: 2.0, a: [4.0, 0.0, 0.0, 0.0], ..Default::default() };
        let slowly = |kinetic| budget(&[wind]).allows(&of(4.0, 0.0), &of(kinetic, 0.0), 0.0, 0.0, 0.01);
        assert!(slowly(4.16) && !slowly(5.0));
    }

    #[test]
    fn small_gains_add_up() {
        let mut budget = budget(&[]);
        let grown: Vec<bool> = (0..4)
            .map(|i| budget.allows(&of(1.04f64.powi(i), 0.0), &of(1.04f64.powi(i + 1), 0.0), 0.0, 0.0, 0.1))
            .collect();
        assert_eq!(grown, [true, true, false, false]);
        // What swings back and forth does not.
        let mut budget = super::tests::budget(&[]);
        assert!((0..20).all(|_| budget.allows(&of(1.0, 0.0), &of(1.06, 0.0), 0.0, 0.0, 0.1)
            && budget.allows(&of(1.06, 0.0), &of(1.0, 0.0), 0.0, 0.0, 0.1)));
    }

    /// A gain that was let pass does not come up again once there is little energy left.
    #[test]
    fn a_loss_is_no_fault() {
        let mut budget = budget(&[]);
        assert!(budget.allows(&of(1.0, 0.0), &of(1.08, 0.0), 0.0, 0.0, 0.1));
        assert!(budget.allows(&of(1.08, 0.0), &of(0.1, 0.96), 0.0, 0.0, 0.1));
        assert!(!budget.allows(&of(0.1, 0.96), &of(0.12, 0.96), 0.0, 0.0, 0.1));
    }

    /// A piston gives 3 J: they are no fault, and without the count they are one.
    #[test]
    fn work_pays_for_itself() {
        let (before, after) = (of(1.0, 0.0), of(4.0, 0.0));
        assert!(budget(&[]).allows(&before, &after, 3.0, 0.0, 0.1));
        assert!(!budget(&[]).allows(&before, &after, 0.0, 0.0, 0.1));
        assert!(!budget(&[]).allows(&before, &before, -0.5, 0.0, 0.1));
    }

    /// 2 kg at 3 m/s, 5 m below the height at which gravity's energy is 0.
    #[test]
    fn what_leaves_takes_its_energy_along() {
        let budget = Budget { gravity: vec![[0.0, 0.0, -10.0]], ..budget(&[]) };
        let at = |z, tag| Particle { x: [0.0, 0.0, z], v: [3.0, 0.0, 0.0], m: 2.0, tag, ..Default::default() };
        let then = [at(-4.9, 0), at(0.0, 0), at(1.0, QUARANTINED), at(2.0, 0)];
        let now = [at(-5.0, QUARANTINED), at(0.0, 0), at(1.0, QUARANTINED), at(2.0, QUARANTINED | DORMANT)];
        assert_eq!(budget.taken(&then, &now), 9.0 - 100.0);
    }
}

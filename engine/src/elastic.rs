//! Which solver moves the bodies of a world, and why: the reason is part of the plan. Opens no device.

use crate::accuracy;
use crate::assemble::Assembled;
use crate::cap::Expected;
use crate::crossing::overlapping;
use crate::scene::{Elastic, Kind, Pressure, Problem};
use crate::stages::lagrangian;
use crate::walls::{distance, width};
use crate::world::{Body, World};

/// The solver of a world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Every body on a grid of its own, instead of all on one (MPM).
    pub total_lagrangian: bool,
    /// Which of the bodies are on grids of their own beside others on one; empty where all move alike.
    pub beside: Vec<bool>,
    /// Why.
    pub why: String,
}

impl Choice {
    /// The solvers in a word; absent where it is the one that the scene's materials have by themselves.
    pub fn name(&self) -> Option<&'static str> {
        match (self.total_lagrangian, self.beside.is_empty()) {
            (true, _) => Some("total Lagrangian"),
            (_, false) => Some("MLS-MPM and total Lagrangian"),
            _ => None,
        }
    }
}

/// Chooses the solver of `world` as `simulation.elastic` asks.
///
/// # Errors
/// A world that cannot be simulated as asked.
pub fn choose(asked: Elastic, world: &World) -> Result<Choice, Problem> {
    let mpm = |why: String| Ok(Choice { total_lagrangian: false, beside: vec![], why });
    if asked == Elastic::UpdatedLagrangian || world.bodies.is_empty() {
        return mpm("as `simulation.elastic` asks".into());
    }
    if let Some(beside) = mixed(asked, world) {
        return beside;
    }
    let obstacle = lagrangian::fit(world).err().map(|(i, why)| format!("'{}' {why}", world.bodies[i].name));
    let obstacle = obstacle.or_else(|| overlap(world, |_| true)).or_else(|| {
        let deep = |b: &Body| Some(format!("'{}' {}", b.name, sunk(b, world)?));
        world.bodies.iter().find_map(deep)
    });
    let loose = || {
        let mut bodies = world.bodies.iter().filter(|_| asked == Elastic::Auto);
        bodies.find_map(|b| match loose(b, world, SAFE) {
            Some(why) => Some(format!("nothing holds '{}', {why}", b.name)),
            None => pierced(b, world).map(|why| format!("'{}' {why}", b.name)),
        })
    };
    match (obstacle.or_else(loose), asked) {
        (Some(why), Elastic::TotalLagrangian) => {
            let message = format!("the bodies cannot be simulated on grids of their own: {why}");
            let help = "take \"auto\" or \"updated_lagrangian\"";
            Err(Problem::new(Kind::Conflict, "simulation.elastic", message).help(help))
        }
        (Some(why), _) => mpm(why),
        (None, _) => Ok(Choice {
            total_lagrangian: true,
            beside: vec![],
            why: match world.bodies.len() {
                1 => "one elastic body on a regular lattice, which neither tears nor flows".into(),
                n => format!("{n} elastic bodies on regular lattices, which neither tear nor flow"),
            },
        }),
    }
}

/// Takes damping from bodies that are not on grids of their own; says whose.
pub fn undamped(choice: &Choice, world: &mut World) -> Vec<String> {
    let own = |i: usize| choice.total_lagrangian || choice.beside.get(i) == Some(&true);
    let damped = world.bodies.iter_mut().enumerate().filter(|(i, b)| b.damping > 0.0 && !own(*i));
    let note = |(_, b): (usize, &mut Body)| {
        b.damping = 0.0;
        format!(
            "`damping` of '{}' is left out: it acts on elastic bodies on grids of their own, and this one is not",
            b.name
        )
    };
    damped.map(note).collect()
}

/// Least thickness of a body beside matter of the grid [cells]: what it meets there is smeared over two, and sand poured
/// on a plate of one fell through it.
const THIN: f32 = 1.75;

fn thickness(body: &Body) -> f32 {
    accuracy::size(&body.positions, body.particle_volume.cbrt())
}

/// Speed over that of waves at which two bodies still meet and part: contact holds at 3.7 (tests/lagrangian/shock.rs), and
/// bodies that stay in each other are seen from 4.6 on. With matter of the grid it has springs alone.
const SAFE: f64 = 2.0;
const SAFE_BESIDE: f64 = 0.5;

/// Why a body that nothing holds is better left to MPM.
fn loose(body: &Body, world: &World, safe: f64) -> Option<String> {
    if body.pinned.contains(&true) {
        return None;
    }
    let (meets, waves) = (Expected::of(world).speed(), f64::from(body.wave_speed()));
    (meets > safe * waves).then(|| {
        format!(
            "and it may meet something at {meets:.1} m/s, more than {safe} times the speed of its waves, {waves:.1} m/s"
        )
    })
}

/// Least thickness of a body whose inside meets obstacles as well as its surface [cells]: three particles.
const FULL: f32 = 1.5;
/// A load over the shear modulus that an obstacle of up to three cells stands without coming through, and as much more for
/// each cell that it is wider. A jelly of 20 cm that falls on a ball of half its size stays on it at 0.34 and comes through at
/// 0.48 with three cells, 0.96 and 1.37 with five, 1.37 and 1.92 with seven (`tests/tests/lagrangian/pierce.rs` has some).
const STANDS: f64 = 0.3;

/// Why obstacles narrower than a body is long could come through it; MPM lets them in by about a cell.
fn pierced(body: &Body, world: &World) -> Option<String> {
    let long = lagrangian::length(body);
    let narrow = world.colliders.iter().filter_map(width).filter(|w| *w < long).min_by(f32::total_cmp)?;
    let thin = thickness(body) < 0.99 * FULL * world.dx;
    let gravity = body.gravity.unwrap_or(world.gravity).iter().map(|g| f64::from(*g).powi(2)).sum::<f64>().sqrt();
    let pressure = f64::from(body.density) * (0.5 * Expected::of(world).speed().powi(2) + gravity * f64::from(long));
    let load = pressure / f64::from(body.constants(world.gravity, world.dx).mu);
    let soft = load > STANDS * f64::from(narrow / world.dx - 2.0).max(1.0);
    let what = if thin { "thin" } else { "soft" };
    (thin || soft).then(|| {
        format!(
            "is {what}, and longer ({long:.2} m) than an obstacle is wide ({narrow:.2} m, {:.1} cells), which could come \
             through it",
            narrow / world.dx
        )
    })
}

/// Why a body cannot begin where it is: contact finds what comes to a surface from outside. What is held may stand in the
/// ground.
fn sunk(body: &Body, world: &World) -> Option<String> {
    let free = body.positions.iter().enumerate().filter(|(i, _)| body.pinned.get(*i) != Some(&true));
    let deepest = |x: &[f32; 3]| world.colliders.iter().map(|c| -distance(c, *x)).fold(f32::MIN, f32::max);
    let most = free.map(|(_, x)| deepest(x)).fold(f32::MIN, f32::max);
    (most > world.dx).then(|| format!("starts inside an obstacle, up to {most:.3} m deep"))
}

/// Where some bodies cannot be on grids of their own whatever is asked, and others can: which are, body by body. Absent
/// where all move alike.
fn mixed(asked: Elastic, world: &World) -> Option<Result<Choice, Problem>> {
    let elastic = |b: &Body| b.material.elastic() && b.emission.is_none() && b.recycle.is_none();
    if world.is_fluid() || world.bodies.iter().all(elastic) {
        return None;
    }
    let fits: Vec<_> = world.bodies.iter().map(|b| lagrangian::fit_body(b, world.dx)).collect();
    let mut own = Vec::new();
    let mut why = Vec::new();
    for (i, (body, fit)) in world.bodies.iter().zip(&fits).enumerate() {
        let held = body.pinned.contains(&true);
        let better_not = || match asked {
            Elastic::Auto => loose(body, world, SAFE_BESIDE)
                .map(|why| format!("nothing holds it, {why}"))
                .or_else(|| {
                    (thickness(body) < THIN * world.dx)
                        .then(|| "so thin that matter of the grid could pass through it".into())
                })
                .or_else(|| pierced(body, world)),
            _ => None,
        };
        let reason = match fit {
            Err(unfit) => Some(unfit.to_string()),
            Ok(()) => (better_not().or_else(|| overlap(world, |j| j == i)).or_else(|| sunk(body, world)))
                .map(|what| format!("is elastic, but {what}")),
        };
        if let (Some(reason), Elastic::TotalLagrangian, true) = (&reason, asked, elastic(body)) {
            let message = format!("'{}' cannot be simulated on a grid of its own: it {reason}", body.name);
            let help = "take \"auto\" or \"updated_lagrangian\"";
            return Some(Err(Problem::new(Kind::Conflict, "simulation.elastic", message).help(help)));
        }
        why.push(match &reason {
            Some(reason) => format!("'{}' by MPM ({reason})", body.name),
            None => format!("'{}' on a grid of its own (elastic{})", body.name, if held { " and held" } else { "" }),
        });
        own.push(reason.is_none());
    }
    let any = own.contains(&true);
    any.then(|| Ok(Choice { total_lagrangian: false, beside: own, why: why.join(", ") }))
}

/// Two bodies, one of them of those that `counts` names, of which particles lie closer than half of their spacing: those
/// that only touch are a whole one apart. Contact of surfaces finds what meets from outside, not what is inside from the
/// start.
fn overlap(world: &World, counts: impl Fn(usize) -> bool) -> Option<String> {
    let name = |i: usize| &world.bodies[i].name;
    overlapping(&world.bodies, 0.25 * world.dx, counts).map(|(a, b)| format!("'{}' and '{}' overlap", name(a), name(b)))
}

impl Assembled {
    /// Which solver moves the bodies, and why.
    pub fn solver(&self) -> String {
        match (self.world.is_fluid(), self.elastic.total_lagrangian) {
            (true, _) => match self.world.fluid.pressure {
                Pressure::Wcsph => "WCSPH, as `simulation.pressure` asks".into(),
                Pressure::Dfsph => "DFSPH, by `simulation.pressure`".into(),
            },
            (_, true) => format!("total Lagrangian: {}", self.elastic.why),
            _ if !self.elastic.beside.is_empty() => format!("MPM and total Lagrangian: {}", self.elastic.why),
            _ => format!("MPM: {}", self.elastic.why),
        }
    }
}

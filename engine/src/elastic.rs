//! Which solver moves the bodies of a world, and why: the reason is part of the plan. Opens no device.

use std::collections::HashMap;

use crate::assemble::Assembled;
use crate::scene::{Elastic, Kind, Pressure, Problem};
use crate::stages::lagrangian;
use crate::world::{Body, World};

/// The solver of a world.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Choice {
    /// Every body on a grid of its own, instead of all on one (MPM).
    pub total_lagrangian: bool,
    /// Why.
    pub why: String,
}

/// Chooses the solver of `world` as `simulation.elastic` asks.
///
/// # Errors
/// A world that cannot be simulated as asked.
pub fn choose(asked: Elastic, world: &World) -> Result<Choice, Problem> {
    let mpm = |why: String| Ok(Choice { total_lagrangian: false, why });
    if asked == Elastic::UpdatedLagrangian || world.bodies.is_empty() {
        return mpm("as `simulation.elastic` asks".into());
    }
    let obstacle = lagrangian::fit(world).err().map(|(i, why)| format!("'{}' {why}", world.bodies[i].name));
    // Contact of surfaces finds what meets from outside, not what is inside from the start.
    let obstacle = obstacle.or_else(|| {
        overlap(world).map(|(a, b)| format!("'{}' and '{}' overlap", world.bodies[a].name, world.bodies[b].name))
    });
    // What falls and hits rings on without damping; MPM's own calms it.
    let loose = || {
        let found = world.bodies.iter().find(|b| !b.pinned.contains(&true)).filter(|_| asked == Elastic::Auto)?;
        Some(format!("nothing holds '{}', and after an impact it would ring on undamped", found.name))
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
            why: match world.bodies.len() {
                1 => "one elastic body on a regular lattice, which neither tears nor flows".into(),
                n => format!("{n} elastic bodies on regular lattices, which neither tear nor flow"),
            },
        }),
    }
}

/// Takes damping from bodies that the shared grid moves, which does not have it; says whose.
pub fn undamped(world: &mut World) -> Vec<String> {
    let damped = world.bodies.iter_mut().filter(|b| b.damping > 0.0);
    let note = |b: &mut Body| {
        b.damping = 0.0;
        format!(
            "`damping` of '{}' is left out: it acts on elastic bodies on grids of their own, and MPM moves this one",
            b.name
        )
    };
    damped.map(note).collect()
}

/// Two bodies of which particles lie closer than half of their spacing: those that only touch are a whole one apart.
fn overlap(world: &World) -> Option<(usize, usize)> {
    let reach = 0.25 * world.dx;
    let cell = |x: &[f32; 3]| x.map(|c| (c / reach).floor() as i64);
    let mut seen: HashMap<[i64; 3], Vec<(usize, [f32; 3])>> = HashMap::new();
    for (i, body) in world.bodies.iter().enumerate() {
        for x in &body.positions {
            let at = cell(x);
            let around = (0..27).map(|k| [at[0] + k % 3 - 1, at[1] + k / 3 % 3 - 1, at[2] + k / 9 - 1]);
            let close =
                |(_, y): &&(usize, [f32; 3])| (0..3).map(|a| (x[a] - y[a]).powi(2)).sum::<f32>() < reach * reach;
            // A body's own come later, so that all that is found is of others.
            if let Some((other, _)) = around.filter_map(|c| seen.get(&c)).flatten().find(close) {
                return Some((*other, i));
            }
        }
        body.positions.iter().for_each(|x| seen.entry(cell(x)).or_default().push((i, *x)));
    }
    None
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
            _ => format!("MPM: {}", self.elastic.why),
        }
    }
}

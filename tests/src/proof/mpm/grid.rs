//! Proof of `mpm/grid`: v_i = Σ (mv) / Σ m over the blocks that reach a node, in contact, and never more
//! than 0.9 dx in a step.

use std::collections::HashMap;

use physvideo_gpu::kernels::{Clock, Collider, Colliders, Counts, Grid};

use super::{Vec3, obstacle, vec3};
use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::{Lattice, TILE, coordinates};
use crate::proof::work::{Work, begun};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "mpm/grid",
    inputs,
    compare,
    tolerance: 8e-6,
    reason: "sums of eight, a division, and per obstacle a rotation by Rodrigues, each a few 6e-8, and near an edge a \
             normal from a distance of a tenth of a cell; relative to the speeds of the material and of what it meets",
    unordered: &[],
    bytes: 16.0 * (216.0 + 64.0) / 64.0,
    flops: 150.0,
};

/// Closer than this to a border between two cases, rounding decides [m, m/s].
pub(super) const MARGIN: f64 = 2e-6;

/// Odd seeds have no obstacle; with every fourth another call forgets the claims.
fn inputs(ask: Ask) -> Call {
    let (call, sorted) = frame(ask);
    let tiles = gifts(ask, sorted.blocks * TILE);
    call.with("tiles", &tiles)
}

/// All that both ways to gather read, but for what they gather.
pub(super) fn frame(ask: Ask) -> (Call, Lattice) {
    let cloud = Cloud::new(Ask { poison: false, ..ask });
    let sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let slots = sorted.grid.capacity as usize;
    let mut colliders = obstacle::obstacles();
    if ask.seed % 2 == 1 {
        colliders.count = 0;
    }
    let dt = if over(ask) { 0.0 } else { 0.0125 };
    let clock = begun(Clock { frame_start: 0.5, t: 0.2, dt, clamped_velocity: 5, ..Default::default() });
    let call = Call::new(slots + 2)
        .constant("FORGETS", if keeps(ask) { 0.0 } else { 1.0 })
        .with("keeps", &[u32::from(keeps(ask))])
        .constant("COUNTS_WORK", if works(ask) { 1.0 } else { 0.0 })
        .with("works", &[u32::from(works(ask) && !over(ask))])
        .with("links", &sorted.links)
        .with("list", &sorted.list)
        .with("table", &sorted.table)
        .with("counts", &vec![7u32; slots * 64])
        .with("live", &[Counts { row_groups: 3, upper: 2, ..sorted.counters() }])
        .with("nodes", &vec![[f32::NAN; 4]; slots * 64])
        .grid(&sorted.grid)
        .with("clock", &[clock])
        .with("colliders", &[colliders]);
    (call, sorted)
}

/// Whether another call forgets the claims.
fn keeps(ask: Ask) -> bool {
    ask.seed % 4 == 3
}

/// Whether the work of obstacles is counted.
fn works(ask: Ask) -> bool {
    ask.seed % 3 != 1
}

/// Whether the frame is done, and nothing is to be counted.
fn over(ask: Ask) -> bool {
    ask.seed % 4 == 2
}

/// What obstacles give to a node whose velocity they change from one to another.
pub(super) fn work(c: &Collider, x: Vec3, time: f64, mass: f64, change: (Vec3, Vec3)) -> (f64, f64) {
    let own = obstacle::velocity(c, x, time);
    (mass * (change.1 - change.0).dot(&own), mass * (change.0.norm() + change.1.norm()) * own.norm())
}

/// Whether the sort finds what it starts with.
fn forgets(call: &Call, out: &Buffers) -> bool {
    let was: Counts = call.buffers.one("live");
    // Without a block there is no workgroup to do it, and nothing to be done.
    let reset = Counts { blocks: 0, nodes: 0, rows: 0, row_groups: 0, upper: 0, cursor: 0, placed: was.cursor, ..was };
    let keeps = call.buffers.one::<u32>("keeps") == 1;
    let want = if was.nodes > 0 && !keeps { reset } else { was };
    let zero = |name: &str| out.get::<u32>(name).iter().all(|n| *n == 0);
    let claims = if keeps { out.bytes("table") == call.buffers.bytes("table") } else { zero("table") };
    claims && zero("counts") && out.one::<Counts>("live") == want
}

/// Momenta and masses, some of them nothing; poisoned: a few not finite or huge.
pub(super) fn gifts(ask: Ask, count: usize) -> Vec<[f32; 4]> {
    let mut random = Random::new(ask.seed ^ 0x9e1d);
    let mut given: Vec<[f32; 4]> = (0..count)
        .map(|_| {
            let (v, m) = (random.vector(2.0), random.range(0.1e-3, 2e-3));
            if random.chance(0.2) { [0.0; 4] } else { [v[0] * m, v[1] * m, v[2] * m, m] }
        })
        .collect();
    if ask.poison {
        for (turn, i) in (100..count).step_by(301).enumerate() {
            given[i][turn % 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3e38, 1e20][turn % 5];
        }
    }
    given
}

/// Momentum, mass and the sum of the momenta's sizes at nodes of the grid.
#[derive(Default)]
pub(super) struct Sums(HashMap<[i64; 3], (Vec3, f64, f64)>);

impl Sums {
    /// Adds what one tile or cell gives to a node.
    pub fn add(&mut self, node: [i64; 3], given: &[f32; 4]) {
        let sum = self.0.entry(node).or_insert((Vec3::zeros(), 0.0, 0.0));
        sum.0 += vec3(given);
        sum.1 += f64::from(given[3]);
        sum.2 += vec3(given).norm();
    }
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (grid, list): (Grid, Vec<u32>) = (call.buffers.one("grid"), call.buffers.get("list"));
    let mut sums = Sums::default();
    for (at, given) in call.buffers.get::<[f32; 4]>("tiles").iter().enumerate() {
        let (block, n) = (coordinates(&grid, list[at / TILE]), at % TILE);
        let local = [n % 6, n / 6 % 6, n / 36];
        sums.add(std::array::from_fn(|i| i64::from(block[i]) * 4 + local[i] as i64), given);
    }
    compare_nodes(call, out, &sums)
}

/// The nodes against those of the twin, given what reaches them.
pub(super) fn compare_nodes(call: &Call, out: &Buffers, sums: &Sums) -> Vec<Compared> {
    let input = &call.buffers;
    let (grid, clock): (Grid, Clock) = (input.one("grid"), input.one("clock"));
    let colliders: Colliders = input.one("colliders");
    let list: Vec<u32> = input.get("list");
    let (dx, dt) = (f64::from(grid.dx), f64::from(clock.dt));
    let time = f64::from(clock.frame_start) + f64::from(clock.t) + dt;
    let got: Vec<[f32; 4]> = out.get("nodes");
    let (mut speeds, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut masses, mut mass_got, mut sound) = (Vec::new(), Vec::new(), true);
    let (mut clamps, mut doubtful, mut done) = (0u32, 0, Work::default());
    for (at, node) in got.iter().enumerate() {
        let block = coordinates(&grid, list[at / 64]);
        let local = [at % 4, at / 4 % 4, at / 16 % 4];
        let place: [i64; 3] = std::array::from_fn(|i| i64::from(block[i]) * 4 + local[i] as i64);
        let (p, m, size) = sums.0.get(&place).copied().unwrap_or((Vec3::zeros(), 0.0, 0.0));
        mass_got.push(f64::from(node[3]));
        masses.push(m);
        if !p.iter().all(|c| c.is_finite()) || size > 1e15 {
            // A sum that is not finite is no velocity; one out of all proportion may overflow on its way.
            sound &= node[..3].iter().all(|c| c.is_finite()) && vec3(node).norm() * dt <= 0.9001 * dx;
            clamps += u32::from(m > 0.0);
            done.doubt = f64::INFINITY;
            continue;
        }
        let mut v = Vec3::zeros();
        let mut margin = f64::INFINITY;
        let mut met = 0.0f64;
        if m > 0.0 {
            v = p / m;
            let x = vec3(&grid.origin) + Vec3::new(place[0] as f64, place[1] as f64, place[2] as f64) * dx;
            for c in &colliders.d[..colliders.count as usize] {
                let (after, clear) = obstacle::contact(c, x, v, time, 0.8 * dx);
                let (joules, size) = work(c, x, time, m, (v, after));
                done.add(joules, size, clear.min(margin) >= MARGIN);
                (v, margin) = (after, margin.min(clear));
                met = met.max(v.norm());
            }
            let most = 0.9 * dx / dt;
            margin = margin.min((v.norm() - most).abs());
            if v.norm() > most {
                v *= most / v.norm();
                clamps += 1;
            }
        }
        if margin < MARGIN {
            doubtful += 1;
            continue;
        }
        speeds.extend(node[..3].iter().map(|c| f64::from(*c)));
        want.extend(v.iter());
        scale.extend([if m > 0.0 { size / m + met } else { 0.0 }; 3]);
    }
    let most = masses.iter().copied().fold(0.0, f64::max);
    let now: Clock = out.one("clock");
    let counted = now.clamped_velocity - clock.clamped_velocity;
    vec![
        Compared::near("mass", mass_got, masses, most),
        Compared::close("velocity", speeds, want, scale),
        done.compare(&clock, &now, input.one::<u32>("works") == 1, CASE.tolerance),
        Compared::fact("few nodes are in doubt", doubtful * 50 <= got.len()),
        Compared::fact("clamps are counted", counted.abs_diff(clamps) as usize <= doubtful),
        Compared::fact("nodes that are not finite stand still or are slowed", sound),
        Compared::fact("the claims, the counts and the counters are forgotten", forgets(call, out)),
    ]
}

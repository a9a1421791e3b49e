//! Proof of `mpm/receive`: v = v + I/m for what a node was given, in contact where that was anything, and never more than 0.9
//! dx in a step; gifts and the sort are forgotten.

use physvideo_gpu::kernels::{Clock, Colliders, Counts, Grid};

use super::{Vec3, grid, obstacle, vec3};
use crate::proof::lattice::coordinates;
use crate::proof::work::Work;
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "mpm/receive",
    inputs,
    compare,
    tolerance: grid::CASE.tolerance,
    reason: grid::CASE.reason,
    unordered: &[],
    bytes: 56.0,
    flops: 60.0,
};

const UNIT: f64 = 1e-9;

fn inputs(ask: Ask) -> Call {
    let (call, sorted) = grid::frame(ask);
    let mut random = Random::new(ask.seed ^ 0x9ec3);
    let slots = sorted.grid.capacity as usize;
    let mut node = |_| {
        let ([x, y, z], m) = (random.vector(2.0), random.range(0.1e-3, 2e-3));
        if random.chance(0.2) { [0.0; 4] } else { [x, y, z, m] }
    };
    let nodes: Vec<[f32; 4]> = (0..slots * 64).map(&mut node).collect();
    let mut random = Random::new(ask.seed ^ 0x61f7);
    let gift = |_| if random.chance(0.4) { [0.0; 3] } else { random.vector(2e6) };
    let gifts: Vec<i32> = (0..slots * 64).flat_map(gift).map(|c| c as i32).collect();
    call.with("nodes", &nodes).with("gifts", &gifts).constant("UNIT", UNIT)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (grid, clock): (Grid, Clock) = (input.one("grid"), input.one("clock"));
    let (colliders, list): (Colliders, Vec<u32>) = (input.one("colliders"), input.get("list"));
    let (was, now): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("nodes"), out.get("nodes"));
    let gifts: Vec<i32> = input.get("gifts");
    let (dx, dt) = (f64::from(grid.dx), f64::from(clock.dt));
    let time = f64::from(clock.frame_start) + f64::from(clock.t) + dt;
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut kept, mut doubtful, mut done) = (true, 0, Work::default());
    for (at, node) in now.iter().enumerate() {
        let (m, given) = (f64::from(was[at][3]), &gifts[3 * at..3 * at + 3]);
        if given == [0; 3] || m == 0.0 {
            kept &= *node == was[at];
            continue;
        }
        let block = coordinates(&grid, list[at / 64]);
        let local = [at % 4, at / 4 % 4, at / 16 % 4];
        let place = Vec3::from_fn(|i, _| f64::from(block[i]) * 4.0 + local[i] as f64);
        let x = vec3(&grid.origin) + place * dx;
        let mut v = vec3(&was[at]) + Vec3::from_fn(|i, _| f64::from(given[i])) * UNIT / m;
        let (mut margin, mut met) = (f64::INFINITY, v.norm() + vec3(&was[at]).norm());
        for c in &colliders.d[..colliders.count as usize] {
            let (after, clear) = obstacle::contact(c, x, v, time, 0.8 * dx);
            let (joules, size) = grid::work(c, x, time, m, (v, after));
            done.add(joules, size, clear.min(margin) >= grid::MARGIN);
            (v, margin) = (after, margin.min(clear));
            met = met.max(v.norm());
        }
        let most = 0.9 * dx / dt;
        margin = margin.min((v.norm() - most).abs());
        v *= (most / v.norm()).min(1.0);
        if margin < grid::MARGIN {
            doubtful += 1;
            continue;
        }
        got.extend(node.map(f64::from));
        want.extend(v.iter().copied().chain([m]));
        scale.extend([met, met, met, m]);
    }
    let counts: Counts = input.one("live");
    let reset =
        Counts { blocks: 0, nodes: 0, rows: 0, row_groups: 0, upper: 0, cursor: 0, placed: counts.cursor, ..counts };
    let none = |ok: bool| ok || list.is_empty();
    vec![
        Compared::close("velocity and mass", got, want, scale),
        done.compare(&clock, &out.one("clock"), input.one::<u32>("works") == 1, CASE.tolerance),
        Compared::fact("who is given nothing keeps its velocity", kept),
        Compared::fact("few nodes are in doubt", doubtful * 50 <= now.len()),
        Compared::fact("gifts are forgotten", out.get::<i32>("gifts").iter().all(|n| *n == 0)),
        Compared::fact("claims are forgotten", none(out.get::<u32>("table").iter().all(|n| *n == 0))),
        Compared::fact("counters are reset", none(out.one::<Counts>("live") == reset)),
    ]
}

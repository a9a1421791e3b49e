//! Proof of `sph/clock`: the step, and that lists are kept as long as nobody can have come nearer than their skin allows.

use physvideo_gpu::kernels::{Clock, Keep, Live};

use super::advance::ranked;
use super::{CELL, h};
use crate::proof::cloud::grid;
use crate::proof::mpm::clock::{compare_clock, sample};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "sph/clock",
    inputs,
    compare,
    tolerance: 4e-7,
    reason: "the step as in `mpm/clock`; a few products and a root in f32 for the skin, relative to h",
    unordered: &[],
    bytes: 0.3,
    flops: 0.05,
};

/// Seeds run through lists that hold, that are worn, the first step of a frame, its end, and no room.
fn inputs(ask: Ask) -> Call {
    let mut clock = sample(ask);
    let mut random = Random::new(ask.seed ^ 0x5ee);
    clock.substeps += 1;
    let mut keep = Keep {
        nodes: 12,
        skin: (0.19 * h()) as f32,
        moved: (random.range(0.0, 0.08) * h() as f32).max(1e-6),
        apart: random.range(0.1, 2.0).to_bits(),
        low: random.vector(1.0).map(ranked),
        high: random.vector(1.0).map(|v| ranked(v + 3.0)),
        searches: 3,
        groups: [9; 3],
        clear: [9; 3],
        ..Default::default()
    };
    clock.dt = random.range(0.1, 0.5) * keep.moved / f32::from_bits(keep.apart);
    let mut live = Live { blocks: 3, nodes: 9, cursor: 100, rows: 70, row_groups: 2, upper: 6, ..Default::default() };
    match ask.seed % 8 {
        1 => keep.moved = (0.12 * h()) as f32,
        2 => clock.substeps = 0,
        3 => keep.spent = 1,
        4 => live.nodes = 0,
        5 => clock.t = clock.frame_length,
        6 => live.overflow = 2,
        0 if ask.seed % 16 == 8 => (keep.low, keep.high) = ([u32::MAX; 3], [0; 3]), // nobody was there
        7 => (keep.moved, clock.longest) = ((0.12 * h()) as f32, 1e-5),
        _ => {}
    }
    if ask.poison {
        keep.apart = f32::INFINITY.to_bits();
        clock.speed_bits = [f32::NAN, f32::INFINITY][ask.items % 2].to_bits();
    }
    Call::new(1)
        .with("clock", &[clock])
        .with("live", &[live])
        .with("keep", &[keep])
        .constant("RECYCLES", f64::from(u8::from(ask.seed % 5 == 4)))
        .constant("INCOMPRESSIBLE", f64::from(u8::from(ask.seed % 3 == 1)))
        .grid(&grid())
}

fn unranked(word: u32) -> f64 {
    f32::from_bits(if word >> 31 == 1 { word & 0x7fff_ffff } else { !word }).into()
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let of = |x: f32| f64::from(x);
    let b = &call.buffers;
    let (was, live_was, kept): (Clock, Live, Keep) = (b.one("clock"), b.one("live"), b.one("keep"));
    let (now, live, keep): (Clock, Live, Keep) = (out.one("clock"), out.one("live"), out.one("keep"));
    let says = |name: &str| call.constants.clone().with(name, 1.0) == call.constants;
    let mut all = compare_clock(&was, &live_was, &now);
    let speed = of(f32::from_bits(kept.apart).min(f32::MAX));
    let moved = of(kept.moved) + of(was.dt) * speed;
    let opens = was.substeps == 0;
    let goes = now.particle_groups[0] > 0;
    let worn = moved > 0.5 * of(kept.skin);
    let searches = goes && (says("RECYCLES") || opens || kept.spent == 1 || worn);
    let nodes = if live_was.nodes > 0 { live_was.nodes } else { kept.nodes };
    let groups = if searches { now.particle_groups[0] } else { 0 };
    let middle = |a: usize| [kept.low[a], kept.high[a]].map(unranked).iter().sum::<f64>() / 2.0;
    let common: [f64; 3] = std::array::from_fn(|a| if kept.low[a] <= kept.high[a] { middle(a) } else { 0.0 });
    let before = if opens { 0 } else { kept.searches };
    all.extend([
        Compared::equal("groups that search", &keep.groups, &[groups, 1, 1]),
        Compared::equal("blocks to forget", &keep.clear, &[if searches { nodes } else { 0 }, 1, 1]),
        Compared::equal("blocks there are", &[keep.nodes], &[nodes]),
        Compared::near("common velocity", keep.drift.map(of).to_vec(), common.to_vec(), 4.0),
        Compared::equal("a new sample", &[keep.low, keep.high].concat(), &[u32::MAX, u32::MAX, u32::MAX, 0, 0, 0]),
        Compared::equal("nobody has moved yet", &[keep.apart], &[0]),
        Compared::equal("searches", &[keep.searches], &[before + u32::from(searches)]),
        Compared::equal("no block is gone over again", &[live.blocks, live.nodes], &[0, 0]),
        Compared::equal("places", &[live.cursor], &[if searches { 0 } else { live_was.cursor }]),
        Compared::equal("lists that are spent", &[keep.spent], &[if searches { 0 } else { kept.spent }]),
    ]);
    if !searches {
        all.push(Compared::near("the most that one has moved", vec![of(keep.moved)], vec![moved], moved));
        all.push(Compared::equal("skin", &[keep.skin.to_bits()], &[kept.skin.to_bits()]));
        return all;
    }
    // The skin of least cost by its derivative's zero, R/L as measured.
    let ratio = if says("INCOMPRESSIBLE") { 0.35 } else { 2.0 };
    let way = 2.0 * of(now.dt) * speed / h();
    let best = (ratio * way).sqrt().min(CELL - 2.0);
    let none = says("RECYCLES") || kept.spent == 1 || best < 2.0 * way;
    all.push(Compared::equal("nothing has moved since", &[keep.moved.to_bits()], &[0]));
    all.push(Compared::near("skin", vec![of(keep.skin)], vec![if none { 0.0 } else { best * h() }], h()));
    all
}

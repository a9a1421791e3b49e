//! Proof of `sph/search`: everyone within 2 h and the skin is listed once, and nobody further than rounded places can be
//! off; where there is no room, everyone within 2 h.

use physvideo_gpu::kernels::{Clock, Counts, Keep};

use super::{CELL, h, spot, vec3};
use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::Lattice;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/search",
    inputs,
    compare,
    tolerance: 0.0,
    reason: "who is listed is exact but in the layer that rounding leaves open",
    unordered: &[],
    bytes: 16.0 + 4.0 + 180.0 + 4.0 + 9.0 * 36.0,
    flops: 288.0 * 10.0,
};

fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask).quarantined();
    for p in &mut cloud.particles {
        p.m *= 8.0; // about the density of water
    }
    // Every second time one cell is so full that its row is gone through in two goes.
    let grid = grid();
    for p in cloud.particles.iter_mut().take(if ask.seed.is_multiple_of(2) { 60 } else { 0 }) {
        for (x, origin) in p.x.iter_mut().zip(grid.origin) {
            *x = origin + grid.dx * (6.5 + ((*x - origin) / grid.dx - 0.5).rem_euclid(1.0));
        }
    }
    let sorted = Lattice::new(grid, &cloud.particles, ask.seed);
    let placed = sorted.counters().cursor as usize;
    let mut places = vec![[f32::NAN; 4]; ask.items];
    let mut spots = vec![u32::MAX; ask.items.next_multiple_of(4)];
    for (at, p) in sorted.order[..placed].iter().enumerate() {
        let p = &cloud.particles[*p as usize];
        places[at] = [p.x[0], p.x[1], p.x[2], 1000.0];
        spots[at] = spot(vec3(&p.x));
    }
    Call::new(ask.items.div_ceil(64) + 1)
        .with("places", &places)
        .with("spots", &spots)
        .with("table", &sorted.table)
        .with("starts", &sorted.starts)
        .with("counts", &sorted.counts)
        .with("live", &[sorted.counters()])
        .with("clock", &[Clock { particles: ask.items as u32, ..Default::default() }])
        .with("lists", &vec![u32::MAX; 64 * ask.items])
        .with("found", &vec![u32::MAX; ask.items])
        .with("keep", &[Keep { skin: [0.19, 0.0, 0.06][ask.seed as usize % 3] * h() as f32, ..Default::default() }])
        .grid(&sorted.grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let placed = call.buffers.one::<Counts>("live").cursor as usize;
    let places: Vec<[f32; 4]> = call.buffers.get("places");
    let (found, lists): (Vec<u32>, Vec<u32>) = (out.get("found"), out.get("lists"));
    let n = places.len();
    // Places are known to 1/256 of a cell: two are off by one an axis, and by ¼ and ½ what is packed below x and y. Such
    // a sum is added to the reach, and such a sum may be lost of a distance: beyond both nobody is listed.
    let off = 2.0 * 2.2 / 256.0 * CELL;
    let skin = f64::from(call.buffers.one::<Keep>("keep").skin) / h();
    let (mut listed, mut crowded, mut spent) = (true, 0..=0, 0..=0);
    let count_in = |sure: bool, perhaps: bool, seen: &mut std::ops::RangeInclusive<u32>| {
        *seen = seen.start() + u32::from(sure)..=seen.end() + u32::from(perhaps);
    };
    for i in 0..placed {
        let x = vec3(&places[i]);
        let within = |reach: f64| -> Vec<u32> {
            let near = |j: &usize| *j != i && (x - vec3(&places[*j])).norm() < reach * h();
            (0..placed).filter(near).map(|j| j as u32).collect()
        };
        let full = |reach: f64| (within(reach - 1e-5).len() > 64, within(reach + off).len() > 64);
        let (tight, bare) = (full(2.0 + skin), full(2.0));
        count_in(tight.0 && skin > 0.0, tight.1 && skin > 0.0, &mut spent);
        count_in(bare.0, bare.1, &mut crowded);
        // Where rounding decides whether there was room, either reach is right.
        let surely = within(if tight.1 { 2.0 } else { 2.0 + skin } - 1e-5);
        let perhaps = within(if tight.0 { 2.0 } else { 2.0 + skin } + off);
        if !bare.1 {
            let count = found[i] as usize;
            let list: Vec<u32> = (0..count).map(|k| lists[(k / 4 * n + i) * 4 + k % 4]).collect();
            listed &= surely.iter().all(|j| list.iter().filter(|l| *l == j).count() == 1);
            listed &= list.iter().all(|l| perhaps.contains(l));
            let padding = count..count.next_multiple_of(4);
            listed &= padding.into_iter().all(|k| lists[(k / 4 * n + i) * 4 + k % 4] == i as u32);
        } else {
            listed &= found[i] as usize >= surely.len().min(64);
        }
    }
    let counted = out.one::<Clock>("clock").clamped_volume;
    vec![
        Compared::fact("neighbours are listed, each once", listed),
        Compared::fact("crowded particles are counted", crowded.contains(&counted)),
        Compared::fact("lists without a skin last for one step", {
            let now = out.one::<Keep>("keep").spent;
            now == 0 && *spent.start() == 0 || now == 1 && *spent.end() > 0
        }),
    ]
}

//! Proof of `sph/search`: everyone within 2 h is listed once, and s = V Σ W, Σ V ∇W and Σ |V ∇W|²/ρ are their sums.

use physvideo_gpu::kernels::{Clock, Counts, Crowd};

use super::{gradient, h, vec3, weight};
use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::Lattice;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/search",
    inputs,
    compare,
    tolerance: 4e-6,
    reason: "distances are known to 1e-6 h in f32 and |slope| ≤ 1/h, its derivative ≤ 3/h²; relative to the sum of the \
             sizes of the terms",
    unordered: &[],
    bytes: 16.0 + 132.0 + 32.0 + 9.0 * 36.0,
    flops: 216.0 * 10.0 + 33.0 * 40.0,
};

fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask).quarantined();
    for p in &mut cloud.particles {
        p.m *= 8.0; // about the density of water
    }
    // Every second time one cell is so full that its row is gone through in two goes.
    let grid = grid();
    for p in cloud.particles.iter_mut().take(if ask.seed.is_multiple_of(2) { 48 } else { 0 }) {
        for (x, origin) in p.x.iter_mut().zip(grid.origin) {
            *x = origin + grid.dx * (6.5 + ((*x - origin) / grid.dx - 0.5).rem_euclid(1.0));
        }
    }
    let sorted = Lattice::new(grid, &cloud.particles, ask.seed);
    let placed = sorted.counters().cursor as usize;
    let volume = h().powi(3) as f32;
    let mut places = vec![[f32::NAN; 4]; ask.items];
    for (place, p) in places.iter_mut().zip(&sorted.order[..placed]) {
        let p = &cloud.particles[*p as usize];
        *place = [p.x[0], p.x[1], p.x[2], p.m / volume];
    }
    Call::new(ask.items.div_ceil(64) + 1)
        .with("places", &places)
        .with("table", &sorted.table)
        .with("starts", &sorted.starts)
        .with("counts", &sorted.counts)
        .with("live", &[sorted.counters()])
        .with("clock", &[Clock { particles: ask.items as u32, ..Default::default() }])
        .with("lists", &vec![u32::MAX; 64 * ask.items])
        .with("crowds", &vec![Crowd::default(); ask.items])
        .grid(&sorted.grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let placed = call.buffers.one::<Counts>("live").cursor as usize;
    let places: Vec<[f32; 4]> = call.buffers.get("places");
    let (crowds, lists): (Vec<Crowd>, Vec<u32>) = (out.get("crowds"), out.get("lists"));
    let n = places.len();
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut listed, mut crowded) = (true, 0);
    for i in 0..placed {
        let x = vec3(&places[i]);
        let (mut fill, mut slope, mut coupling, mut size) = (weight(0.0), super::Vec3::zeros(), 0.0, 0.0);
        let (mut surely, mut perhaps) = (Vec::new(), Vec::new());
        for j in (0..placed).filter(|j| *j != i) {
            let d = x - vec3(&places[j]);
            let q = d.norm() / h();
            if q < 2.0 - 1e-5 {
                surely.push(j as u32);
            } else if q < 2.0 + 1e-5 {
                perhaps.push(j as u32);
            }
            if q < 2.0 {
                let g = gradient(d);
                fill += weight(q);
                slope += g;
                coupling += g.norm_squared() / f64::from(places[j][3]);
                size += g.norm();
            }
        }
        let crowd = &crowds[i];
        if surely.len() <= 64 {
            let list: Vec<u32> = (0..crowd.count as usize).map(|k| lists[(k / 4 * n + i) * 4 + k % 4]).collect();
            listed &= surely.iter().all(|j| list.iter().filter(|l| *l == j).count() == 1);
            listed &= list.iter().all(|l| surely.contains(l) || perhaps.contains(l));
            let padding = crowd.count as usize..(crowd.count as usize).next_multiple_of(4);
            listed &= padding.into_iter().all(|k| lists[(k / 4 * n + i) * 4 + k % 4] == i as u32);
        } else {
            crowded += 1;
        }
        got.extend([f64::from(crowd.fill), f64::from(crowd.coupling)]);
        got.extend(crowd.slope.map(f64::from));
        want.extend([fill, coupling, slope[0], slope[1], slope[2]]);
        scale.extend([
            fill,
            coupling + 1.0 / 400.0 / h() / h() * 1e-2,
            size + 0.01 / h(),
            size + 0.01 / h(),
            size + 0.01 / h(),
        ]);
    }
    let counted = out.one::<Clock>("clock").clamped_volume;
    vec![
        Compared::fact("neighbours are listed, each once", listed),
        Compared::equal("crowded particles are counted", &[counted], &[crowded]),
        Compared::close("sums", got, want, scale),
    ]
}

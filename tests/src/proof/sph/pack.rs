//! Proof of `sph/pack`: particles in the order of their cells, those of a cell by their numbers.

use physvideo_gpu::kernels::{Counts, Particle};

use super::{h, spot, vec3};
use crate::proof::cloud::{Cloud, grid};
use crate::proof::lattice::Lattice;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/pack",
    inputs,
    compare,
    tolerance: 4e-7,
    reason: "copies, but for the density: a division by h³ in f32",
    unordered: &[],
    bytes: 56.0 + 56.0 + 36.0,
    flops: 10.0,
};

fn inputs(ask: Ask) -> Call {
    let cloud = Cloud::new(ask).quarantined();
    let sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let nothing = vec![[0.0f32; 4]; ask.items];
    Call::new(ask.items.div_ceil(64) + 1)
        .with("was", &cloud.particles)
        .with("order", &sorted.order)
        .with("keys", &sorted.cells())
        .with("starts", &sorted.starts)
        .with("counts", &sorted.counts)
        .with("live", &[sorted.counters()])
        .with("places", &nothing)
        .with("moves", &nothing)
        .with("warm", &nothing)
        .with("numbers", &vec![0u32; ask.items])
        .with("spots", &vec![0u32; ask.items])
        .grid(&sorted.grid)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let particles: Vec<Particle> = b.get("was");
    let mut order: Vec<u32> = b.get("order");
    let (starts, counts): (Vec<u32>, Vec<u32>) = (b.get("starts"), b.get("counts"));
    for (first, count) in starts.iter().zip(&counts) {
        order[*first as usize..(first + count) as usize].sort_unstable();
    }
    let placed = b.one::<Counts>("live").cursor as usize;
    order.truncate(placed);
    let numbers: Vec<u32> = out.get("numbers");
    let got = |name: &str| -> Vec<f64> {
        out.get::<[f32; 4]>(name)[..placed].iter().flat_map(|v| [v[0], v[1], v[2]]).map(f64::from).collect()
    };
    let want = |f: fn(&Particle) -> [f32; 3]| -> Vec<f64> {
        order.iter().flat_map(|p| f(&particles[*p as usize])).map(f64::from).collect()
    };
    let fourth = |name: &str| out.get::<[f32; 4]>(name)[..placed].iter().map(|v| v[3]).collect::<Vec<_>>();
    let densities: Vec<f64> = order.iter().map(|p| f64::from(particles[*p as usize].m) / h().powi(3)).collect();
    let tags: Vec<u32> = order.iter().map(|p| particles[*p as usize].tag).collect();
    // On the border between two, rounding decides: each axis' fields differ by one at most.
    let alike = |(got, p): (&u32, &u32)| {
        let want = spot(vec3(&particles[*p as usize].x));
        let off = |bits: u32, shift: u32| ((got >> shift).wrapping_sub(want >> shift) + 1) % (1 << bits) <= 2;
        off(11, 21) && off(11, 10) && off(10, 0)
    };
    let spots: Vec<u32> = out.get("spots");
    vec![
        Compared::fact("rounded places", spots.iter().zip(&order).all(alike)),
        Compared::equal("numbers", &numbers[..placed], &order),
        Compared::near("places", got("places"), want(|p| p.x), 0.0),
        Compared::near("velocities", got("moves"), want(|p| p.v), 0.0),
        Compared::near("warm", got("warm"), want(|p| [p.s[0], p.s[1], p.s[2]]), 0.0),
        Compared::equal("tags", &fourth("moves").iter().map(|t| t.to_bits()).collect::<Vec<_>>(), &tags),
        Compared::close(
            "densities",
            fourth("places").into_iter().map(f64::from).collect(),
            densities.clone(),
            densities,
        ),
    ]
}

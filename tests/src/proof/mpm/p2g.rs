//! Proof of `mpm/p2g`: m_i = Σ w m, (mv)_i = Σ w m (v + dt a + C (x_i − x_p)) − dt V0 τ ∇w (Jiang 2015; Stomakhin 2013), or with
//! 4/dx² w (x_i − x_p) for ∇w (Hu 2018, eq. 16).

use physvideo_gpu::kernels::{Body, Clock, Forces, Grid, Particle};

use super::{Vec3, affine, bodies, force, spline, stress, vec3};
use crate::proof::cloud::{Cloud, PINNED, grid};
use crate::proof::lattice::{Lattice, NOWHERE, TILE, coordinates};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/p2g",
    inputs,
    compare,
    tolerance: 2e-6,
    reason: "a place x/dx ≈ 16 cells is known to 1e-6 cells in f32, so are the weights; relative to what a particle \
             carries, summed over those in reach",
    unordered: &[],
    bytes: 96.0 + 4.0 + 16.0 * 27.0 / 8.0,
    flops: 600.0,
};

/// Odd seeds use the MLS gradient.
pub(super) fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask).quarantined();
    keep_clear(&mut cloud.particles);
    let sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let slots = sorted.grid.capacity as usize;
    Call::new(slots + 2)
        .constant("TRUE_GRADIENT", f64::from(u8::from(ask.seed.is_multiple_of(2))))
        .with("particles", &cloud.particles)
        .with("bodies", &bodies())
        .with("order", &sorted.order)
        .with("starts", &sorted.starts)
        .with("counts", &sorted.counts)
        .with("tiles", &vec![[f32::NAN; 4]; slots * TILE])
        .grid(&sorted.grid)
        .with("clock", &[clock()])
        .with("forces", &[force::forces()])
}

fn clock() -> Clock {
    Clock { frame_start: 0.75, t: 0.25, dt: 2e-3, ..Default::default() }
}

/// Moves particles off the borders of force regions, where rounding decides.
fn keep_clear(particles: &mut [Particle]) {
    let forces = force::forces();
    for p in particles {
        while force::acceleration(&forces, u32::MAX, vec3(&p.x), vec3(&p.v), 1.0).1 {
            p.x[0] += 3.0 * force::MARGIN as f32;
        }
    }
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let mut order: Vec<u32> = call.buffers.get("order");
    let (starts, counts): (Vec<u32>, Vec<u32>) = (call.buffers.get("starts"), call.buffers.get("counts"));
    for (first, count) in starts.iter().zip(&counts) {
        order[*first as usize..(first + count) as usize].sort_unstable();
    }
    let mut compared = compare_tiles(call, out);
    compared.push(Compared::equal("cells are put in order", &out.get::<u32>("order"), &order));
    compared
}

/// The tiles of every block; the same for each way to sum them.
pub(super) fn compare_tiles(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let particles: Vec<Particle> = input.get("particles");
    let (bodies, forces): (Vec<Body>, Forces) = (input.get("bodies"), input.one("forces"));
    let (grid, clock): (Grid, Clock) = (input.one("grid"), input.one("clock"));
    let true_gradient = call.constants == physvideo_gpu::Constants::none().with("TRUE_GRADIENT", 1.0);
    let (dx, dt) = (f64::from(grid.dx), f64::from(clock.dt));
    // The list of blocks is not the kernel's business, only ours: it sums tiles.
    let sorted = Lattice::new(self::grid(), &particles, 0);
    let (starts, counts): (Vec<u32>, Vec<u32>) = (input.get("starts"), input.get("counts"));
    let order: Vec<u32> = input.get("order");
    let slots = grid.capacity as usize;
    let mut want = vec![(Vec3::zeros(), 0.0); slots * TILE];
    let mut scale = vec![(0.0, 0.0); slots * TILE];
    for cell in 0..slots * 64 {
        let range = starts[cell] as usize..(starts[cell] + counts[cell]) as usize;
        for p in order[range].iter().map(|p| *p as usize) {
            assert_ne!(sorted.keys[p], NOWHERE, "inputs order an unsound particle");
            let block = coordinates(&grid, sorted.keys[p] / 64);
            let p = &particles[p];
            let free = if p.tag & PINNED == 0 { 1.0 } else { 0.0 };
            let (m, v, c, tau) = (f64::from(p.m), vec3(&p.v), affine(p), stress(p));
            let mask = bodies[(p.tag & 0xff) as usize].fields;
            let time = f64::from(clock.frame_start) + f64::from(clock.t);
            let (a, _) = force::acceleration(&forces, mask, vec3(&p.x), v, time);
            let mass = if free > 0.0 { m } else { 1e6 * m };
            let carried = m * (v.norm() + dt * a.norm() + c.norm() * dx) + 4.0 * dt * tau.norm() / dx;
            for r in spline::reach(&grid, &p.x) {
                let local: Vec<i64> = (0..3).map(|i| r.node[i] - i64::from(block[i]) * 4).collect();
                if local.iter().any(|l| !(0..6).contains(l)) {
                    continue; // a weight that rounding made more than nothing
                }
                let gradient = if true_gradient { r.gradient } else { r.offset * (4.0 / (dx * dx) * r.weight) };
                let at = cell / 64 * TILE + (local[2] * 36 + local[1] * 6 + local[0]) as usize;
                want[at].0 += free * (r.weight * m * (v + dt * a + c * r.offset) - dt * tau * gradient);
                want[at].1 += r.weight * mass;
                scale[at].0 += carried;
                scale[at].1 += mass;
            }
        }
    }
    let got: Vec<[f32; 4]> = out.get("tiles");
    vec![
        Compared::close(
            "momentum",
            got.iter().flat_map(|t| [t[0], t[1], t[2]]).map(f64::from).collect(),
            want.iter().flat_map(|w| [w.0[0], w.0[1], w.0[2]]).collect(),
            scale.iter().flat_map(|s| [s.0; 3]).collect(),
        ),
        Compared::close(
            "mass",
            got.iter().map(|t| f64::from(t[3])).collect(),
            want.iter().map(|w| w.1).collect(),
            scale.iter().map(|s| s.1).collect(),
        ),
    ]
}

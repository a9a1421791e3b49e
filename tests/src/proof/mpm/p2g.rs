//! Proof of `mpm/p2g`: m_i = Σ w m, (mv)_i = Σ w m (v + dt a + C (x_i − x_p)) − dt V0 τ ∇w (Jiang 2015; Stomakhin 2013), or with
//! 4/dx² w (x_i − x_p) for ∇w (Hu 2018, eq. 16).

use physvideo_gpu::kernels::{Body, Clock, Forces, Grid, Particle, Row};

use super::grid_rows::{ROW_LANES, SHARES};
use super::{Vec3, affine, bodies, force, spline, stress, vec3};
use crate::proof::cloud::{Cloud, PINNED, grid};
use crate::proof::lattice::{Lattice, TILE, base};
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
fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask).quarantined();
    keep_clear(&mut cloud.particles);
    let sorted = Lattice::new(grid(), &cloud.particles, ask.seed);
    let rows = sorted.rows.len();
    Call::new(rows.div_ceil(ROW_LANES) + 1)
        .constant("TRUE_GRADIENT", f64::from(u8::from(ask.seed.is_multiple_of(2))))
        .with("particles", &cloud.particles)
        .with("bodies", &bodies())
        .with("order", &sorted.order)
        .same("placed", "order")
        .with("rows", &sorted.rows)
        .with("counts", &sorted.counts)
        .with("starts", &sorted.starts)
        .with("shares", &vec![[f32::NAN; 4]; rows * SHARES])
        .with("live", &[sorted.counters()])
        .grid(&sorted.grid)
        .with("clock", &[clock()])
        .with("forces", &[force::forces()])
        .with("spans", &sorted.spans)
}

/// The same for the forms that sum into tiles, a workgroup a slot.
pub(super) fn tile_inputs(ask: Ask) -> Call {
    let call = inputs(ask);
    let slots = call.buffers.one::<Grid>("grid").capacity as usize;
    Call { groups: slots as u32 + 2, same: Vec::new(), ..call }.with("tiles", &vec![[f32::NAN; 4]; slots * TILE])
}

fn clock() -> Clock {
    Clock { frame_start: 0.75, t: 0.25, dt: 2e-3, ..Default::default() }
}

/// Moves particles off the borders of force regions, where rounding decides.
fn keep_clear(particles: &mut [Particle]) {
    let forces = force::forces();
    let everything = Body { fields: u32::MAX, ..Default::default() };
    for p in particles {
        while force::acceleration(&forces, &everything, vec3(&p.x), vec3(&p.v), 1.0).1 {
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
    let got: Vec<[f32; 4]> = out.get("shares");
    let mut compared = compare_sums(call, &got, |row, cell, o| row * SHARES + (cell % 4 + o[0]) * 9 + o[2] * 3 + o[1]);
    compared.push(Compared::equal("cells are put in order", &out.get::<u32>("order"), &order));
    compared
}

/// The tiles of every block; the same for each way to sum them.
pub(super) fn compare_tiles(call: &Call, out: &Buffers) -> Vec<Compared> {
    compare_sums(call, &out.get::<[f32; 4]>("tiles"), |_, cell, o| {
        let local = [cell % 4, cell / 4 % 4, cell / 16 % 4];
        cell / 64 * TILE + (local[2] + o[2]) * 36 + (local[1] + o[1]) * 6 + local[0] + o[0]
    })
}

/// Sums `got` against the twin's; `place` says where the share of a cell (its row's place in the list, its number) at the
/// node `offset` from it goes.
fn compare_sums(call: &Call, got: &[[f32; 4]], place: fn(usize, usize, [usize; 3]) -> usize) -> Vec<Compared> {
    let input = &call.buffers;
    let particles: Vec<Particle> = input.get("particles");
    let (bodies, forces): (Vec<Body>, Forces) = (input.get("bodies"), input.one("forces"));
    let (grid, clock): (Grid, Clock) = (input.one("grid"), input.one("clock"));
    let true_gradient = call.constants == physvideo_gpu::Constants::none().with("TRUE_GRADIENT", 1.0);
    let (dx, dt) = (f64::from(grid.dx), f64::from(clock.dt));
    let order: Vec<u32> = input.get("order");
    let mut want = vec![(Vec3::zeros(), 0.0); got.len()];
    let mut scale = vec![(0.0, 0.0); got.len()];
    for (row, at) in input.get::<Row>("rows").into_iter().enumerate() {
        for p in order[at.first as usize..(at.first + at.count) as usize].iter().map(|p| *p as usize) {
            let p = &particles[p];
            let base = base(&grid, p.x).expect("only sound particles are ordered");
            let free = if p.tag & PINNED == 0 { 1.0 } else { 0.0 };
            let (m, v, c, tau) = (f64::from(p.m), vec3(&p.v), affine(p), stress(p));
            let body = &bodies[(p.tag & 0xff) as usize];
            let time = f64::from(clock.frame_start) + f64::from(clock.t);
            let (a, _) = force::acceleration(&forces, body, vec3(&p.x), v, time);
            let mass = if free > 0.0 { m } else { 1e6 * m };
            let carried = m * (v.norm() + dt * a.norm() + c.norm() * dx) + 4.0 * dt * tau.norm() / dx;
            for r in spline::reach(&grid, &p.x) {
                let offset: [i64; 3] = std::array::from_fn(|i| r.node[i] - i64::from(base[i]));
                if offset.iter().any(|o| !(0..3).contains(o)) {
                    continue; // a weight that rounding made more than nothing
                }
                let gradient = if true_gradient { r.gradient } else { r.offset * (4.0 / (dx * dx) * r.weight) };
                let to = place(row, at.id as usize * 4 + base[0] as usize % 4, offset.map(|o| o as usize));
                want[to].0 += free * (r.weight * m * (v + dt * a + c * r.offset) - dt * tau * gradient);
                want[to].1 += r.weight * mass;
                scale[to].0 += carried;
                scale[to].1 += mass;
            }
        }
    }
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

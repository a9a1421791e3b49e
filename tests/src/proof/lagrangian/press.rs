//! Proof of `lagrangian/press`: overlap is what the grid's matter, interpolated by the B-spline, is more than the room beside
//! the body; a pressure for it and a spring that slips along the surface; the nodes lose what the facet gets, by mass.

use physvideo_gpu::kernels::{Clock, ElasticCell, Facet, Grid, Touch};

use super::surface::{GROUP, NO_FACET, facets, moved};
use super::{Bodies, DX, NOBODY};
use crate::proof::lattice::index;
use crate::proof::mpm::{Vec3, spline, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/press",
    inputs,
    compare,
    tolerance: 2e-5,
    reason: "places of half a metre (6e-8 each) on cells of 4 cm, and sums of 27 products of three such weights",
    unordered: &[],
    bytes: 2600.0,
    flops: 2000.0,
};

/// A facet that is met from both sides.
const SHEET: u32 = 0x800;
const DENSITY: f64 = 900.0;
const STIFFNESS: f64 = 3e5;
const FRICTION: f64 = 0.4;
const UNIT: f64 = 1e-9;
const STEP: f32 = 1.1e-3;
const WAVE: f32 = 6.0;
/// Share of the density from which closing counts.
const LEAST: f64 = 0.02;

/// Bodies half outside a grid of which a fifth of the blocks are not active, and a few found no room.
fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mut random = Random::new(ask.seed ^ 0x94e5);
    if ask.poison && !b.u.is_empty() {
        b.u[0] = [f32::NAN; 4];
    }
    let mut all = facets(&b, &mut random);
    for (i, f) in all.iter_mut().enumerate() {
        f.room = random.range(0.2, 0.9);
        f.push = if f.point == NOBODY { NOBODY } else { 4 * i as u32 };
        f.tag |= if random.chance(0.3) { SHEET } else { 0 };
    }
    let blocks = [3, 4, 3];
    let mut slots: Vec<u32> = (0..36).filter(|_| random.chance(0.8)).collect();
    random.shuffle(&mut slots);
    let room = slots.len().saturating_sub(2);
    let mut table = vec![0u32; 36];
    slots.iter().zip(1..).for_each(|(block, slot)| table[*block as usize] = slot);
    let grid = Grid {
        origin: [-0.11, -0.12, -0.09],
        dx: DX as f32,
        blocks,
        capacity: room as u32,
        count: all.len() as u32,
        ..Default::default()
    };
    let full = (DENSITY * DX.powi(3)) as f32;
    let node = |random: &mut Random| {
        let [x, y, z] = random.vector(2.0);
        // Now and then one that is held, with a mass beyond all others'.
        let m = if random.chance(0.02) { 1e4 } else { random.range(0.0, 2.2) };
        if random.chance(0.3) { [0.0; 4] } else { [x, y, z, m * full] }
    };
    let nodes: Vec<[f32; 4]> = (0..64 * room).map(|_| node(&mut random)).collect();
    let touches: Vec<Touch> = all
        .iter()
        .map(|_| Touch {
            force: [7.0; 3],
            energy: random.range(0.0, 0.02),
            slip: random.vector(0.01),
            dt: random.range(0.0, 1.5e-3),
        })
        .collect();
    let beside = ask.seed % 2 == 1;
    let pushes: Vec<[f32; 4]> = (0..4 * all.len())
        .map(|_| if beside { random.vector(1.0) } else { [f32::NAN; 3] })
        .map(|[x, y, z]| [x, y, z, 0.5])
        .collect();
    let clock = Clock { wave_speed: WAVE, dt: STEP, ..Default::default() };
    Call::new(all.len() / GROUP + 1)
        .grid(&grid)
        .constant("BESIDE", f64::from(u8::from(beside)))
        .constant("DENSITY", DENSITY)
        .constant("STIFFNESS", STIFFNESS)
        .constant("FRICTION", FRICTION)
        .constant("UNIT", UNIT)
        .with("cells", &b.cells)
        .with("facets", &all)
        .with("u", &b.u)
        .with("v", &b.v)
        .with("table", &table)
        .with("nodes", &nodes)
        .with("touches", &touches)
        .same("touches_was", "touches")
        .with("pushes", &pushes)
        .with("gifts", &vec![3i32; 3 * 64 * room])
        .with("clock", &[clock])
}

/// What the law says of one facet: force, energy, slip, the nodes it reaches with their shares of the reaction, the share
/// of the density and how fast it closes.
struct Law {
    force: Vec3,
    energy: f64,
    slip: Vec3,
    shares: Vec<(usize, f64)>,
    fill: f64,
    closing: f64,
}

/// A node near a place: where it is kept, its weight, the slope of that a metre, velocity and mass.
struct Near {
    at: usize,
    weight: f64,
    slope: Vec3,
    v: Vec3,
    m: f64,
}

impl Law {
    fn of(f: &Facet, was: &Touch, (x, speed, area): (Vec3, Vec3, Vec3), around: &[Near]) -> Self {
        let full = DENSITY * DX.powi(3);
        let share = |n: &Near| n.m.min(2.0 * full) / full;
        let fill: f64 = around.iter().map(|n| n.weight * share(n)).sum();
        let slope: Vec3 = around.iter().map(|n| n.slope * share(n)).sum();
        let mass: f64 = around.iter().map(|n| n.weight * n.m).sum();
        let momentum: Vec3 = around.iter().map(|n| n.weight * n.m * n.v).sum();
        let none = mass <= 0.0 || !x.iter().all(|c| c.is_finite());
        let rate = if none { Vec3::zeros() } else { speed - momentum / mass };
        let depth = if none { 0.0 } else { (fill - f64::from(f.room)).max(0.0) * DX / 0.55 };
        let n = area.normalize();
        // From the side that is denser, by how much steeper that is than a flat surface.
        let sheet = f.tag & SHEET != 0;
        let against = if sheet { (slope.dot(&n) * DX / 0.55).clamp(-1.0, 1.0) } else { 1.0 };
        // A stretched face counts as it was at rest.
        let k = area.norm().min(0.25 * DX * DX) / (1.0 / f64::from(f.stiffness) + 1.0 / STIFFNESS);
        let slid = vec3(&was.slip) + f64::from(was.dt) * rate;
        let along = slid - n * slid.dot(&n);
        let most = f64::from(f.friction).min(FRICTION) * depth;
        let kick = (f64::from(was.dt) + f64::from(STEP)) / 2.0;
        let slip = if depth > 0.0 { along * (most / along.norm()).min(1.0) } else { Vec3::zeros() };
        let closing = against * rate.dot(&n);
        Self {
            force: -k * (depth * against * n + slip),
            energy: (f64::from(was.energy) + kick * k * depth * closing).clamp(0.0, k * depth * depth / 2.0),
            slip,
            shares: around.iter().map(|n| (n.at, n.weight * n.m / mass)).filter(|s| s.1 > 0.0).collect(),
            fill,
            closing,
        }
    }
}

/// Nodes around a place: of active blocks only; none where the place is too near the grid's border.
fn nodes_around(grid: &Grid, table: &[u32], nodes: &[[f32; 4]], x: &Vec3) -> Vec<Near> {
    let at: Vec3 = (x - vec3(&grid.origin)) / DX;
    let base = at.map(|c| (c - 0.5).floor());
    let last = |a: usize| f64::from(4 * grid.blocks[a]) - 3.0;
    if !(0..3).all(|a| base[a] >= 0.0 && base[a] <= last(a)) {
        return Vec::new();
    }
    let all = (0..27u32).filter_map(|i| {
        let node: [u32; 3] = std::array::from_fn(|a| base[a] as u32 + i / 3u32.pow(a as u32) % 3);
        let off = |a: usize| at[a] - f64::from(node[a]);
        let product = |sloped: Option<usize>| -> f64 {
            (0..3)
                .map(|a| if sloped == Some(a) { spline::slope(off(a)) / DX } else { spline::weight(off(a)) })
                .product()
        };
        let slot = table[index(grid, node.map(|n| n / 4)) as usize].wrapping_sub(1);
        let local = node[2] % 4 * 16 + node[1] % 4 * 4 + node[0] % 4;
        let at = (slot < grid.capacity).then(|| (slot * 64 + local) as usize)?;
        let slope = Vec3::from_fn(|a, _| product(Some(a)));
        Some(Near { at, weight: product(None), slope, v: vec3(&nodes[at]), m: nodes[at][3].into() })
    });
    all.collect()
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, list): (Vec<ElasticCell>, Vec<Facet>) = (input.get("cells"), input.get("facets"));
    let (u, v): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("v"));
    let (grid, table): (Grid, Vec<u32>) = (input.one("grid"), input.get("table"));
    let (nodes, touches): (Vec<[f32; 4]>, Vec<Touch>) = (input.get("nodes"), input.get("touches"));
    let (was, now): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("pushes"), out.get("pushes"));
    let (felt, gifts): (Vec<Touch>, Vec<i32>) = (out.get("touches"), out.get("gifts"));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let mut add = |g: &[f32], w: &[f64], size: f64| {
        got.extend(g.iter().map(|c| f64::from(*c)));
        want.extend(w);
        scale.extend(std::iter::repeat_n(size, w.len()));
    };
    let beside = was.first().is_some_and(|p| !p[0].is_nan());
    let mut given = vec![(Vec3::repeat(3.0 * UNIT), 0.0, 1.0); nodes.len()];
    let (mut kept, mut close, mut speed) = (true, false, 0.0f64);
    for (i, f) in list.iter().enumerate() {
        if f.tag & NO_FACET != 0 {
            kept &= felt[i].energy == touches[i].energy;
            continue;
        }
        let (x, rate, _, area) = moved(f, &cells, &u, &v);
        kept &= felt[i].dt == STEP;
        let axis = f.tag >> 8 & 3;
        let to = f.push.wrapping_add(1 + axis) as usize;
        if f.push != NOBODY {
            kept &= now[to][3] == if f.tag >> 10 & 1 == 1 { 0.25 } else { -0.25 };
        }
        if !x.iter().all(|c| c.is_finite()) {
            // It meets nothing, wherever it is.
            kept &= felt[i].energy == 0.0;
            continue;
        }
        let law = Law::of(f, &touches[i], (x, rate, area), &nodes_around(&grid, &table, &nodes, &x));
        let size = area.norm() * f64::from(f.stiffness) * DX;
        if f.push != NOBODY {
            let first = if beside { vec3(&was[to]) } else { Vec3::zeros() };
            add(&now[to][..3], (first + law.force).as_slice(), size + 1.0);
        }
        add(&felt[i].force, law.force.as_slice(), size);
        add(&[felt[i].energy], &[law.energy], size * DX);
        add(&felt[i].slip, law.slip.as_slice(), DX);
        let impulse = -0.5 * (f64::from(touches[i].dt) + f64::from(STEP)) * law.force;
        if law.force != Vec3::zeros() {
            for (at, share) in &law.shares {
                given[*at].0 += *share * impulse;
                given[*at].1 += size * 1.3e-3 * share;
                given[*at].2 += 1.0;
            }
        }
        close |= (law.fill - LEAST).abs() < 1e-5;
        if law.fill > LEAST && law.closing > 0.0 {
            speed = speed.max(f64::from(WAVE) + law.closing);
        }
    }
    for (found, (sum, size, count)) in gifts.chunks(3).zip(&given) {
        let units: Vec<f32> = found.iter().map(|n| (f64::from(*n) * UNIT) as f32).collect();
        // Half a unit of rounding for each that gave.
        add(&units, sum.as_slice(), size + count * UNIT / CASE.tolerance);
    }
    let clock: Clock = out.one("clock");
    let mut facts = vec![
        Compared::close("forces, energies, slips and gifts", got, want, scale),
        Compared::fact("steps and ways are kept, and what is no facet is left alone", kept),
    ];
    if !close {
        facts.push(Compared::near(
            "limit of the next step",
            vec![f32::from_bits(clock.speed_bits).into()],
            vec![speed],
            1.0,
        ));
    }
    facts
}

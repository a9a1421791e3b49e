//! Proof of `lagrangian/surface`: x = X + Σ N u at the face, its area by Nanson's formula, its normal turned with it, its
//! way since the last step, bounds of groups.

use physvideo_gpu::kernels::{Bounds, ElasticCell, Facet, Patch, Surface, Tie};

use super::{Bodies, DX, NOBODY, WAVE, at_point, cofactor, quarter, solids};
use crate::proof::mpm::{Mat3, Vec3, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/surface",
    inputs,
    compare,
    tolerance: 4e-6,
    reason: "sums of 27 products in f32; a normal is divided by the length of one that is turned and stretched",
    unordered: &[],
    bytes: 1000.0,
    flops: 1100.0,
};

/// No facet.
pub const NO_FACET: u32 = 0x8000_0000;
/// Facets of a group.
pub const GROUP: usize = 64;

/// Facets of the points at the surface, one each, with some that are held and the last group filled up.
pub fn facets(b: &Bodies, random: &mut Random) -> Vec<Facet> {
    let mut all: Vec<Facet> = b
        .skins
        .iter()
        .map(|s| {
            let (axis, up) = (random.below(3), random.chance(0.5));
            let mut x = s.x;
            x[axis] += if up { 0.25 } else { -0.25 } * DX as f32;
            Facet {
                x,
                point: if random.chance(0.1) { NOBODY } else { s.point },
                normal: s.normal,
                tag: s.tag & 0xff | (axis as u32) << 8 | u32::from(up) << 10,
                stiffness: random.range(1e4, 1e5),
                friction: random.range(0.0, 1.0),
                push: random.below(1000) as u32,
                ..Default::default()
            }
        })
        .collect();
    all.resize(all.len().next_multiple_of(GROUP), Facet { tag: 2 | NO_FACET, point: NOBODY, ..Default::default() });
    all
}

fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mut random = Random::new(ask.seed ^ 0xface);
    if ask.poison && !b.u.is_empty() {
        b.u[0] = [f32::NAN; 4];
    }
    let all = facets(&b, &mut random);
    let tie = |f: &Facet| {
        let was = random.vector(0.01);
        Tie {
            slip: random.vector(0.01),
            energy: 7.0,
            x: std::array::from_fn(|a| f.x[a] + was[a]),
            reach: if random.chance(0.8) { random.range(0.3, 1.5) * DX as f32 } else { 0.0 },
        }
    };
    let ties: Vec<Tie> = all.iter().map(tie).collect();
    let groups = all.len() / GROUP;
    Call::new(groups + 1)
        .immediates(&Surface { dx: DX as f32, facets: all.len() as u32 })
        .with("cells", &b.cells)
        .with("facets", &all)
        .with("solids", &solids())
        .with("u", &b.u)
        .with("v", &b.v)
        .with("ties", &ties)
        .with("patches", &vec![Patch { x: [f32::NAN; 3], ..Default::default() }; all.len()])
        .with("bounds", &vec![Bounds { low: [f32::NAN; 3], ..Default::default() }; groups])
}

/// A facet by the equations: its middle, velocity, normal and area.
pub(super) fn moved(f: &Facet, cells: &[ElasticCell], u: &[[f32; 4]], v: &[[f32; 4]]) -> (Vec3, Vec3, Vec3, Vec3) {
    let axis = (f.tag >> 8 & 3) as usize;
    let way = if f.tag >> 10 & 1 == 1 { 1.0 } else { -1.0 };
    let (mut x, mut speed, mut cof) = (vec3(&f.x), Vec3::zeros(), Mat3::identity());
    if f.point != NOBODY {
        let cell = &cells[(f.point >> 3) as usize];
        let mut place = quarter(f.point & 7);
        cof = cofactor(&(Mat3::identity() + at_point(cell, u, place).1));
        place[axis] += 0.25 * way;
        x += at_point(cell, u, place).0;
        speed = at_point(cell, v, place).0;
    }
    let (normal, side) = (cof * vec3(&f.normal), cof.column(axis).into_owned());
    let area = 0.25 * DX * DX * way * side;
    (x, speed, normal.normalize(), area)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, facets): (Vec<ElasticCell>, Vec<Facet>) = (input.get("cells"), input.get("facets"));
    let (u, v): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("v"));
    let ties: Vec<Tie> = input.get("ties");
    let (patches, bounds): (Vec<Patch>, Vec<Bounds>) = (out.get("patches"), out.get("bounds"));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let mut add = |g: &[f32; 3], w: Vec3, size: f64| {
        got.extend(g.map(f64::from));
        want.extend(w.as_slice());
        scale.extend([size; 3]);
    };
    let mut kept = true;
    for (g, group) in facets.chunks(GROUP).enumerate() {
        let (mut low, mut high) = (Vec3::repeat(f64::MAX), Vec3::repeat(f64::MIN));
        let (mut slow, mut fast, mut sound) = (low, high, true);
        for (k, f) in group.iter().enumerate() {
            let (i, patch) = (g * GROUP + k, &patches[g * GROUP + k]);
            kept &= patch.tag == f.tag && patch.stiffness == f.stiffness && patch.friction == f.friction;
            kept &= patch.push == f.push;
            if f.tag & NO_FACET != 0 {
                kept &= patch.area == [0.0; 3] && patch.x[0] > 1e9;
                continue;
            }
            let (x, speed, normal, area) = moved(f, &cells, &u, &v);
            if !x.iter().all(|c| c.is_finite()) {
                sound = false;
                continue;
            }
            (low, high) = (low.inf(&x), high.sup(&x));
            (slow, fast) = (slow.inf(&speed), fast.sup(&speed));
            add(&patch.x, x, 1.0);
            add(&patch.normal, normal, 5.0);
            add(&patch.area, area, 5.0 * DX * DX);
            add(&patch.v, speed, 1.0);
            // The root of 500 kg/m³.
            kept &= (patch.dense - 22.36068).abs() < 1e-4;
            let reach = if ties[i].reach > 0.0 { ties[i].reach } else { 0.5 * DX as f32 };
            kept &= patch.reach == reach && patch.wave == WAVE as f32;
            let way = if ties[i].reach > 0.0 { x - vec3(&ties[i].x) } else { Vec3::zeros() };
            add(&patch.slid, 0.5 * vec3(&ties[i].slip) + way, 1.0);
        }
        kept &= bounds[g].body == group[0].tag & 0xff;
        // NaN may be the least or the largest, or neither.
        if sound {
            add(&bounds[g].low, low, 1.0);
            add(&bounds[g].high, high, 1.0);
            add(&bounds[g].slowest, slow, 1.0);
            add(&bounds[g].fastest, fast, 1.0);
        }
    }
    vec![
        Compared::close("places, normals, areas, ways and bounds", got, want, scale),
        Compared::fact("tags and constants stay, and what is no facet is away", kept),
    ]
}

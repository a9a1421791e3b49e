//! Proof of `source/recycle`: what is inside the region starts anew somewhere in the source, or is taken out; all else keeps its bits.

use physvideo_gpu::kernels::{Clock, Deformation, Particle, Return};

use crate::proof::cloud::{Cloud, DORMANT, PINNED, QUARANTINED, body_count};
use crate::proof::lattice::{awake, busy, idle};
use crate::proof::mpm::{Vec3, vec3};
use crate::proof::work::{Work, begun};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "source/recycle",
    inputs,
    compare,
    tolerance: 2e-7,
    reason: "a product and a sum of numbers below 1, rounded once each",
    unordered: &[],
    bytes: 96.0,
    flops: 20.0,
};

/// Closer to the border of a region than this [m] rounding decides.
const MARGIN: f64 = 1e-6;

/// Every third body returns from a box, every third from a ball, the others not at all.
fn returns() -> Vec<Return> {
    let each = |i: usize| Return {
        region: i as u32 % 3,
        solid: [1.0, 0.0][i / 3 % 2],
        stream: 77 + i as u32,
        region_min: [-0.1, 0.2, 0.1, 0.0],
        region_max: [if i % 3 == 2 { 0.15 } else { 0.2 }, 0.5, 0.4, 0.0],
        source_min: [0.1, -0.2, 0.3, 0.0],
        source_max: [0.5, 0.1 * i as f32, 0.4, 0.0],
        velocity: [0.5, -0.25, i as f32, 0.0],
        drains: u32::from(i == 4),
        gravity: [0.0, 0.5, -9.81 + i as f32, 0.0],
    };
    (0..body_count()).map(each).collect()
}

/// Distance inside the region, negative outside.
fn inside(r: &Return, x: Vec3) -> f64 {
    let (low, high) = (vec3(&r.region_min), vec3(&r.region_max));
    match r.region {
        1 => (x - low).min().min((high - x).min()),
        2 => high[0] - (x - low).norm(),
        _ => f64::NEG_INFINITY,
    }
}

fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask);
    let returns = returns();
    for p in &mut cloud.particles {
        while inside(&returns[(p.tag & 0xff) as usize], vec3(&p.x)).abs() < MARGIN {
            p.x[0] += 3.0 * MARGIN as f32;
        }
    }
    if let Some(p) = cloud.particles.get_mut(40) {
        (p.tag, p.x) = (1 | QUARANTINED, [0.0, 0.3, 0.2]); // of a body that returns from a box
    }
    let turns: Vec<u32> = (0..ask.items as u32).map(|i| i * 7 % 5).collect();
    let awake = awake(ask.items, ask.seed);
    let clock =
        begun(Clock { dt: 1e-3, particles: ask.items as u32, idle: idle(&awake, ask.items), ..Default::default() });
    let works = u32::from(ask.seed % 2 == 1);
    Call::new(awake.len().div_ceil(64))
        .constant("COUNTS_WORK", f64::from(works))
        .with("works", &[works])
        .with("awake", &awake)
        .with("particles", &cloud.particles)
        .with("deformations", &cloud.deformations)
        .with("turns", &turns)
        .with("tally", &[3u32])
        .with("clock", &[clock])
        .same("was", "particles")
        .with("returns", &returns)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (before, after): (Vec<Particle>, Vec<Particle>) = (input.get("particles"), out.get("particles"));
    let (was, now): (Vec<Deformation>, Vec<Deformation>) = (input.get("deformations"), out.get("deformations"));
    let (turns, returns): (Vec<u32>, Vec<Return>) = (input.get("turns"), input.get("returns"));
    let mut done = Work::default();
    let (mut kept, mut fresh, mut boxed, mut drained, mut total) = (true, true, true, true, 3);
    let busy = busy(&input.get::<u32>("awake"), before.len());
    let mut want_turns = turns.clone();
    let mut places = Vec::new();
    for (i, (p, q)) in before.iter().zip(&after).enumerate() {
        let to = &returns[(p.tag & 0xff) as usize];
        let arrived = p.x.iter().all(|c| c.is_finite()) && inside(to, vec3(&p.x)) > 0.0;
        if p.tag & (PINNED | QUARANTINED) != 0 || !arrived || !busy[i] {
            let same = |a: &[u8], b: &[u8]| a == b;
            kept &= same(bytemuck::bytes_of(p), bytemuck::bytes_of(q))
                && same(bytemuck::bytes_of(&was[i]), bytemuck::bytes_of(&now[i]));
            continue;
        }
        total += 1;
        let energy = |x: Vec3, v: Vec3| f64::from(p.m) * (0.5 * v.norm_squared() - vec3(&to.gravity).dot(&x));
        let new = if to.drains != 0 { 0.0 } else { energy(vec3(&q.x), vec3(&q.v)) };
        let gone = energy(vec3(&p.x), vec3(&p.v));
        let size = f64::from(p.m) * (vec3(&p.v).norm_squared() + 10.0) + new.abs();
        done.add(new - gone, size, size.is_finite() && size < 1e6);
        if to.drains != 0 {
            drained &= *q == Particle { tag: p.tag | DORMANT | QUARANTINED, ..*p } && now[i] == was[i];
            continue;
        }
        want_turns[i] += 1;
        let (low, high) = (vec3(&to.source_min), vec3(&to.source_max));
        let place = (vec3(&q.x) - low).component_div(&(high - low));
        boxed &= place.iter().all(|u| (-1e-6..=1.0 + 1e-6).contains(u));
        places.push(place);
        let velocity: [f32; 3] = std::array::from_fn(|a| to.velocity[a]);
        fresh &= *q == Particle { x: q.x, tag: p.tag, v: velocity, m: p.m, ..Default::default() };
        let f1 = [0.0, to.solid, 0.0, 0.0];
        fresh &= now[i] == Deformation { f0: [1.0, 0.0, 0.0, was[i].f0[3]], f1, f2: [0.0, 0.0, to.solid, 0.0] };
    }
    let mut compared = vec![
        Compared::fact("all others keep their bits", kept),
        Compared::fact("the state of the start", fresh),
        done.compare(&input.one("clock"), &out.one("clock"), input.one::<u32>("works") == 1, 1e-6),
        Compared::fact("inside the source", boxed),
        Compared::fact("what drains is taken out, and only that", drained),
        Compared::equal("turns", &out.get::<u32>("turns"), &want_turns),
        Compared::equal("tally", &out.get::<u32>("tally"), &[total]),
    ];
    if places.len() >= 40 {
        // Uniform: mean 1/2 and variance 1/12 along each axis, within five standard errors.
        let n = places.len() as f64;
        let mean = places.iter().sum::<Vec3>() / n;
        let spread = places.iter().map(|u| (u - mean).component_mul(&(u - mean))).sum::<Vec3>() / n;
        let near = |v: f64, to: f64, sigma: f64| (v - to).abs() < 5.0 * sigma / n.sqrt();
        let fair = mean.iter().all(|m| near(*m, 0.5, 0.289)) && spread.iter().all(|s| near(*s, 1.0 / 12.0, 0.0745));
        compared.push(Compared::fact("places are uniform", fair));
    }
    compared
}

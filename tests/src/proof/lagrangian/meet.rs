//! Proof of `lagrangian/meet`: for each pair of facets of two bodies a pressure for its depth, much steeper from a quarter of
//! a cell on, that of a shock, and a spring along the surface limited by Coulomb's law.

use physvideo_gpu::kernels::{Bounds, Clock, Patch, Surface, Tie};

use super::surface::{GROUP, NO_FACET};
use super::{DX, NOBODY, give, hurry, rebound};
use crate::proof::mpm::{Vec3, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/meet",
    inputs,
    compare,
    tolerance: 1e-5,
    reason: "depths are differences of places of half a metre (6e-8 each) of some centimetres; sums of some tens of pairs",
    unordered: &[],
    bytes: 2500.0,
    flops: 20_000.0,
};

/// Facets in a group, so that a thousand are more than a tile of 64 groups.
const FILLED: usize = 12;
const STEP: f32 = 1e-3;
const WAVE: f64 = 6.0;

/// Groups of three bodies around each other, at most a few cells from each other.
fn inputs(ask: Ask) -> Call {
    let mut random = Random::new(ask.seed ^ 0x3ee7);
    let groups = ask.items.div_ceil(FILLED);
    let size = DX * 0.9 * (groups as f64).cbrt();
    let (mut patches, mut bounds) = (Vec::new(), Vec::new());
    for g in 0..groups {
        let (middle, drift) = (random.vector(size as f32), random.vector(4.0));
        let body = random.below(3) as u32;
        let count = FILLED.min(ask.items - g * FILLED);
        let mut b = Bounds { body, low: [f32::MAX; 3], high: [f32::MIN; 3], ..Default::default() };
        (b.slowest, b.fastest) = (drift.map(|c| c - 0.2), drift.map(|c| c + 0.3));
        for k in 0..GROUP {
            let axis = random.below(3) as u32;
            let normal = vec3(&random.vector(1.0)).normalize();
            let area = DX * DX * 0.25 * (normal + 0.5 * vec3(&random.vector(1.0)));
            let x = random.vector(1.2 * DX as f32);
            let mut patch = Patch {
                x: std::array::from_fn(|a| 0.3 + middle[a] + x[a]),
                tag: body | axis << 8 | u32::from(random.chance(0.5)) << 10,
                normal: std::array::from_fn(|a| normal[a] as f32),
                stiffness: random.range(1e4, 1e5),
                area: std::array::from_fn(|a| area[a] as f32),
                friction: random.range(0.0, 1.0),
                slid: random.vector(0.2 * DX as f32),
                push: if random.chance(0.1) { NOBODY } else { 4 * (g * GROUP + k) as u32 },
                v: random.vector(3.0),
                dense: random.range(20.0, 80.0),
                reach: random.range(0.1, 1.0) * DX as f32,
                wave: random.range(0.5, 6.0),
                damping: random.range(0.0, 0.01),
                spare: 0,
            };
            if k >= count {
                patch = Patch { x: [1e15; 3], tag: body | NO_FACET, area: [0.0; 3], push: NOBODY, ..patch };
            } else {
                (0..3).for_each(|a| {
                    (b.low[a], b.high[a]) = (b.low[a].min(patch.x[a]), b.high[a].max(patch.x[a]));
                });
            }
            patches.push(patch);
        }
        bounds.push(b);
    }
    if ask.poison && !patches.is_empty() {
        patches[0].x = [f32::NAN; 3];
        bounds[0].fastest = [f32::NAN; 3];
    }
    let beside = ask.seed % 2 == 1;
    let pushes: Vec<[f32; 4]> = (0..4 * patches.len())
        .map(|_| if beside { random.vector(1.0) } else { [f32::NAN; 3] })
        .map(|[x, y, z]| [x, y, z, 0.5])
        .collect();
    let clock = Clock { wave_speed: WAVE as f32, dt: STEP, ..Default::default() };
    Call::new(groups + 1)
        .immediates(&Surface { dx: DX as f32, facets: patches.len() as u32 })
        .constant("BESIDE", f64::from(u8::from(beside)))
        .with("patches", &patches)
        .with("bounds", &bounds)
        .with("ties", &vec![Tie { energy: f32::NAN, ..Default::default() }; patches.len()])
        .with("pushes", &pushes)
        .with("clock", &[clock])
}

/// What the law says of one facet.
#[derive(Default)]
struct Law {
    force: Vec3,
    slip: Vec3,
    weight: f64,
    energy: f64,
    deepest: f64,
    /// Fastest along the normals [m/s].
    coming: f64,
    /// Size of what was added up.
    size: f64,
    /// A decision on the way was close to going the other way.
    close: bool,
}

impl Law {
    fn add(&mut self, own: &Patch, other: &Patch) {
        let d = vec3(&own.x) - vec3(&other.x);
        self.close |= (d.norm() - 2.0 * DX).abs() < 1e-6;
        // One that is not anywhere meets nobody.
        if d.norm().is_nan() || d.norm() >= 2.0 * DX {
            return;
        }
        let n = (vec3(&other.normal) - vec3(&own.normal)).normalize();
        let depth = -d.dot(&n);
        let across = d + depth * n;
        // W = 4/(π R²) (1 − r²/R²)³, R seven eighths of a cell.
        // Stretched faces lie further apart, and count as at rest.
        let grown = vec3(&own.area).norm().max(vec3(&other.area).norm()) / (0.25 * DX * DX);
        let wide = 0.875 * DX * grown.max(1.0).sqrt();
        let q = 1.0 - across.norm_squared() / (wide * wide);
        let faces = [-vec3(&own.area).dot(&n), vec3(&other.area).dot(&n)];
        let against = -vec3(&own.normal).dot(&vec3(&other.normal));
        // Not deeper than before and the way since then, twice for good measure.
        let sank = -(vec3(&own.slid) - vec3(&other.slid)).dot(&n);
        let reach = f64::from(own.reach.max(other.reach)) + 2.0 * sank.max(0.0);
        self.close |= (depth - reach).abs() < 1e-6;
        if q <= 0.0 || depth >= reach || depth <= 0.0 || against <= 0.25 || faces.iter().any(|f| *f <= 0.0) {
            return;
        }
        // Full from 60° on, none above 75.5°.
        let facing = (4.0 * against - 1.0).clamp(0.0, 1.0);
        let weight =
            facing * faces[0] * faces[1] * 4.0 / std::f64::consts::PI / (wide * wide) * q.powi(3) / grown.max(1.0);
        let k = weight / (1.0 / f64::from(own.stiffness) + 1.0 / f64::from(other.stiffness));
        let slid = vec3(&own.slid) - vec3(&other.slid);
        let along = slid - n * slid.dot(&n);
        let (pressed, stored) = give(depth, 0.03 * DX, 0.25 * DX);
        let friction = f64::from(own.friction.min(other.friction));
        let kept = along * (friction * pressed / along.norm()).min(1.0);
        // Each takes its part of the closing speed, so that both feel the same q = 1.5 ρ w².
        let rate = (vec3(&other.v) - vec3(&own.v)).dot(&n);
        let closing = rate.max(0.0);
        let fast = hurry(closing, f64::from(own.wave) + f64::from(other.wave));
        let part = fast / (1.0 + f64::from(own.dense) / f64::from(other.dense));
        let shock = weight * 1.5 * f64::from(own.dense).powi(2) * part * part;
        // Each spring is damped as its body is, and gives way by its part of the depth.
        let part =
            |a: &Patch, b: &Patch| f64::from(a.damping) / (1.0 + f64::from(a.stiffness) / f64::from(b.stiffness));
        let shock = shock + k * (part(own, other) + part(other, own)) * closing;
        let pushed = pressed * rebound(rate, f64::from(own.wave) + f64::from(other.wave));
        self.force += k * (pushed * n - kept) + shock * n;
        self.size += shock;
        self.slip += weight * kept;
        self.weight += weight;
        self.energy += k * (stored + kept.norm_squared() / 2.0) / 2.0;
        self.deepest = self.deepest.max(depth);
        self.coming = self.coming.max(rate.abs());
        self.size += k * (DX + pressed);
    }
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (patches, bounds): (Vec<Patch>, Vec<Bounds>) = (input.get("patches"), input.get("bounds"));
    let (was, now): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("pushes"), out.get("pushes"));
    let (ties, clock): (Vec<Tie>, Clock) = (out.get("ties"), out.one("clock"));
    let beside = was.first().is_some_and(|p| !p[0].is_nan());
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let mut add = |g: &[f32], w: &[f64], size: f64| {
        got.extend(g.iter().map(|c| f64::from(*c)));
        want.extend(w);
        scale.extend(std::iter::repeat_n(size, w.len()));
    };
    let body = |p: &Patch| p.tag & 0xff;
    let real: Vec<Patch> = patches.iter().filter(|p| p.tag & NO_FACET == 0).copied().collect();
    let mut touched = vec![false; was.len()];
    let (mut kept, mut sound, mut speed) = (true, true, 0.0f64);
    for (i, own) in patches.iter().enumerate() {
        let axis = own.tag >> 8 & 3;
        let to = own.push.wrapping_add(1 + axis) as usize;
        if own.tag & NO_FACET != 0 {
            kept &= ties[i].energy.is_nan();
            continue;
        }
        let mut law = Law::default();
        real.iter().filter(|p| body(p) != body(own)).for_each(|other| law.add(own, other));
        if own.push != NOBODY {
            touched[to] = true;
            kept &= now[to][3] == if own.tag >> 10 & 1 == 1 { 0.25 } else { -0.25 };
        }
        if law.close || !vec3(&own.x).iter().all(|c| c.is_finite()) {
            sound = false;
            continue;
        }
        let size = law.size + 1e-3;
        if own.push != NOBODY {
            let first = if beside { vec3(&was[to]) } else { Vec3::zeros() };
            add(&now[to][..3], (first + law.force).as_slice(), size + 1.0);
        }
        add(&ties[i].slip, (law.slip / law.weight.max(1e-30)).as_slice(), 1.0);
        add(&[ties[i].energy], &[law.energy], size * DX);
        kept &= ties[i].x == own.x;
        add(&[ties[i].reach], &[law.deepest + 0.05 * DX], 1.0);
        if law.deepest > 0.0 {
            // c √((1 + p')/2), p' the slope of the pressure over that at no depth.
            let deep = law.deepest + law.coming * f64::from(STEP);
            speed = speed.max(WAVE * (0.5 + 0.5 * (1.0 + 5.0 * (deep / (0.25 * DX)).powi(4))).sqrt());
        }
    }
    kept &=
        now.iter().zip(&was).zip(&touched).all(|((now, was), t)| *t || now.map(f32::to_bits) == was.map(f32::to_bits));
    let mut facts = vec![
        Compared::close("forces, slips and energies", got, want, scale),
        Compared::fact("places are kept, and other pushes", kept),
    ];
    // With an approach the limit is that of its workgroup's deepest pair: between the two bounds.
    let rates = bounds.iter().flat_map(|a| bounds.iter().map(move |b| (a, b))).filter_map(|(a, b)| approach(a, b));
    let closing = rates.fold(0.0f64, f64::max);
    if sound && !bounds.iter().any(|b| b.fastest[0].is_nan()) {
        let found = f64::from(f32::from_bits(clock.speed_bits));
        let quick = closing + 2.0 * hurry(closing, 2.0 * WAVE);
        let least = speed.max(if closing > 0.0 { WAVE + quick } else { 0.0 });
        let fits = found >= least * (1.0 - 1e-5) && found <= (speed.max(WAVE) + quick) * (1.0 + 1e-5);
        facts.push(Compared::fact("the next step is limited", fits));
    }
    facts
}

/// How fast two groups may come together, if they can meet within two steps.
fn approach(a: &Bounds, b: &Bounds) -> Option<f64> {
    if a.body == b.body {
        return None;
    }
    let apart = (vec3(&b.low) - vec3(&a.high)).sup(&(vec3(&a.low) - vec3(&b.high))).sup(&Vec3::zeros()).norm();
    let rate = (vec3(&b.fastest) - vec3(&a.slowest)).sup(&(vec3(&a.fastest) - vec3(&b.slowest))).norm();
    (apart < 2.0 * rate * f64::from(STEP)).then_some(rate)
}

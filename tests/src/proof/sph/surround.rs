//! Proof of `sph/surround`: walls as mirror images, gravity and fields, Tait's pressure ρ c²/7 (s⁷ − 1) ≥ 0 over s², the
//! response A = (max((S + w)·(S/steep + w), 0) + Σ|V∇W|²/steep)/ρ.

use nalgebra::{Rotation3, Unit};
use physvideo_gpu::kernels::{Body, Clock, Collider, Colliders, Counts, Crowd, Debt, Forces, Local, family::shape};

use super::spread::inside;
use super::wall::{mirrored, squeezed};
use super::{Liquid, Vec3, Vectors, h, sheared, steep, vec3, weight as weight_at};
use crate::proof::cloud::{LED, PINNED};
use crate::proof::mpm::force;
use crate::proof::mpm::obstacle::obstacles;
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "sph/surround",
    inputs,
    compare,
    tolerance: 1e-4,
    reason: "distances are known to 1e-7 m, 5e-6 h, and slopes have derivatives up to 4/h²; s⁷ − 1 multiplies what s has \
             by 7; weights of surfaces that coincide have ten times a distance's error, normals at an edge that over its \
             distance; each relative to the size of its terms",
    unordered: &[],
    bytes: 100.0 + 96.0,
    flops: 400.0,
};

/// Odd seeds look at the last step's pressures instead of this one's; of four, two shift particles.
fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    // Spread over the space where the obstacles are.
    for i in 0..liquid.placed {
        let place = &mut liquid.places[i];
        let x = [-0.25, 0.15, 0.1].map(f32::from);
        let r = liquid.random.vector(0.5);
        (place[0], place[1], place[2]) = (x[0] + 0.5 + r[0] * 0.7, x[1] + 0.2 + r[1] * 0.4, x[2] + 0.15 + r[2] * 0.3);
        place[0] -= 0.5;
        if i % 4 == 0 {
            let r = liquid.random.vector(0.5);
            let gap = h() as f32 * liquid.random.range(-0.3, 1.1);
            place[..3].copy_from_slice(&[MIDDLE[0] + 0.26 * r[0], MIDDLE[1] + 0.24 * r[1], MIDDLE[2] + gap]);
        }
    }
    for (i, crowd) in liquid.crowds.iter_mut().enumerate() {
        // Of five one is almost alone.
        let share = if i % 5 == 1 { 0.005 } else { 0.5 };
        crowd.slope = crowd.slope.map(|c| share * c);
        crowd.coupling *= 2.0 * share * share;
    }
    let moves: Vec<[f32; 4]> = liquid.vectors(|r| {
        let v = r.vector(2.0);
        [v[0], v[1], v[2], f32::from_bits(r.below(2) as u32 | if r.chance(0.1) { PINNED } else { 0 })]
    });
    let warm = liquid.vectors(|r| [1.0, 1.0, r.range(0.0, 60.0), if r.chance(0.5) { 0.0 } else { r.range(0.0, 60.0) }]);
    let bodies = [
        Body { fields: 0b1011, mu: 5e-3, gravity: [0.1, 0.2, -9.81], ..Default::default() },
        Body { fields: 0b0101, mu: 0.2, gravity: [0.0, -3.0, 0.5], ..Default::default() },
    ];
    // A room that turns so fast that the work of two of its walls in a corner shows.
    let mut colliders = walls();
    colliders.d[5].spin = [0.0, 0.0, 3.0, 0.0];
    let n = ask.items;
    let mut numbers: Vec<u32> = (0..n as u32).collect();
    liquid.random.shuffle(&mut numbers);
    let debt = |random: &mut Random| Debt {
        owed: random.range(-0.1, 0.1),
        noted: if random.chance(0.2) { 0.0 } else { 0.8 },
        head: 7.0,
        spare: 0.0,
    };
    let debts: Vec<Debt> = (0..n).map(|_| debt(&mut liquid.random)).collect();
    let call = liquid.call();
    // Of two seeds one is in the last step of a frame.
    let clock = Clock { frame_length: if ask.seed % 2 == 1 { 0.252 } else { 0.3 }, ..call.buffers.one("clock") };
    call.constant("INCOMPRESSIBLE", (ask.seed % 2) as f64)
        .constant("SHIFTS", (ask.seed / 2 % 2) as f64)
        .with("moves", &moves)
        .with("warm", &warm)
        .with("bodies", &bodies)
        .with("forces", &[force::forces()])
        .with("colliders", &[colliders])
        .with("clock", &[clock])
        .with("numbers", &numbers)
        .with("debts", &debts)
        .with("points", &vec![[0.0f32; 4]; n])
        .with("flows", &vec![[0.0f32; 4]; n])
        .with("locals", &vec![Local::default(); n])
}

/// Middle of a face of two boxes [m].
const MIDDLE: [f32; 3] = [-0.16, 0.56, 0.31];

/// The obstacles, a box let into another, so that two faces all but coincide, and a box above them with less than h between.
fn walls() -> Colliders {
    let mut all = obstacles();
    let flat = |z: f64, high: f64, speed: f32| Collider {
        shape: shape::BOX,
        end: 1e9,
        start: 0.99,
        center: [MIDDLE[0], MIDDLE[1], z as f32, 0.0],
        size: [0.11, 0.1, high as f32, 0.0],
        velocity: [0.3, 0.0, speed, 0.0],
        ..Default::default()
    };
    let top = f64::from(MIDDLE[2]);
    let low = Collider { friction: 0.3, ..flat(top - 0.04, 0.04, 0.0) };
    let other = Collider { sticky: 1, spin: [0.1, 0.0, 0.0, 0.0], ..flat(top + 0.06 * h() - 0.03, 0.03, 0.1) };
    let above = Collider { friction: 0.2, ..flat(top + 0.7 * h() + 0.05, 0.05, -0.2) };
    all.d[all.count as usize..][..3].copy_from_slice(&[low, other, above]);
    all.count += 3;
    all
}

/// A surface near a point: distance in h, outward normal, by how much that normal is unique.
fn surfaces(c: &Collider, r: Vec3) -> Vec<(f64, Vec3, f64)> {
    let size = vec3(&c.size);
    match c.shape {
        shape::PLANE => vec![(r.dot(&size) / h(), size, 1.0)],
        shape::BALL => vec![((r.norm() - size[0]) / h(), r.normalize(), 1.0)],
        shape::BOX => {
            let q = r.abs() - size;
            let outside = q.map(|c| c.max(0.0));
            let sign = r.map(f64::signum);
            if outside.norm() > 0.0 {
                return vec![(outside.norm() / h(), outside.component_mul(&sign).normalize(), 1.0)];
            }
            vec![face(q, sign)]
        }
        shape::ROOM => {
            let q = r.abs() - size;
            let sign = r.map(f64::signum);
            if q.max() > 0.0 {
                let (d, n, tie) = face(q, sign);
                return vec![(-d, -n, tie)];
            }
            let wall = |a: usize, up: f64| ((size[a] + up * r[a]) / h(), Vec3::ith(a, up), 1.0);
            (0..3).flat_map(|a| [wall(a, 1.0), wall(a, -1.0)]).collect()
        }
        _ => vec![],
    }
}

fn face(q: Vec3, sign: Vec3) -> (f64, Vec3, f64) {
    let a = q.imax();
    let next = (0..3).filter(|i| *i != a).map(|i| q[i]).fold(f64::NEG_INFINITY, f64::max);
    (q[a] / h(), Vec3::ith(a, sign[a]), (q[a] - next) / h())
}

/// A surface that a particle is near to.
struct Facing {
    d: f64,
    n: Vec3,
    tie: f64,
    speed: Vec3,
    sticky: bool,
    friction: f64,
}

/// The surfaces within h of a place.
fn near(colliders: &Colliders, x: Vec3, time: f64) -> Vec<Facing> {
    let of = |c: &Collider| {
        let (start, end) = (f64::from(c.start), f64::from(c.end));
        let moved = time.clamp(start, end) - start;
        let spin = vec3(&c.spin);
        let turn = Unit::try_new(spin, 0.0)
            .map_or_else(Rotation3::identity, |axis| Rotation3::from_axis_angle(&axis, spin.norm() * moved));
        let r = x - (vec3(&c.center) + vec3(&c.velocity) * moved);
        let running = time >= start && time < end;
        let speed = if running { vec3(&c.velocity) + spin.cross(&r) } else { Vec3::zeros() };
        let (sticky, friction) = (c.sticky == 1, f64::from(c.friction));
        let facing = |(d, n, tie): (f64, Vec3, f64)| Facing { d, n: turn * n, tie, speed, sticky, friction };
        surfaces(c, turn.inverse() * r).into_iter().map(facing).collect::<Vec<_>>()
    };
    colliders.d[..colliders.count as usize].iter().flat_map(of).filter(|s| s.d < 1.001).collect()
}

/// What walls do, in the letters of `lib/wall`.
struct Met {
    free: f64,
    slope: Vec3,
    drift: f64,
    lift: Vec3,
    squeeze: Vec3,
    power: f64,
    loose: f64,
    slide: Vec3,
    friction: f64,
    weight: f64,
    drag: f64,
}

/// 0 up to `from`, 1 from 1 on.
fn smooth(from: f64, x: f64) -> f64 {
    smooth_to(1.0 - from, x - from)
}

/// 0 up to 0, 1 from `to` on.
fn smooth_to(to: f64, x: f64) -> f64 {
    let t = (x / to).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// Sums over them, and whether no decision on the way was close. What is free is Π (1 − share)^w, w the weight of a surface
/// among those that face the way it does: e^(−d/0.1 h) over the sum of theirs. Of those that face each other the gap
/// lacks l = o (h − d₁ − d₂), o by their angle: each is met l/2 further away, and its share grows by `grows` l/2.
fn meet(near: &[Facing], drive: Vec3, nu: f64, grows: f64) -> (Met, bool) {
    let mut clear = near.iter().all(|s| s.d.abs() > 0.02 && s.tie > 1e-3 && (s.d - 1.0).abs() > 1e-3);
    let met: Vec<&Facing> = near.iter().filter(|s| s.d < 1.0).collect();
    let mut shares = Vec::new();
    for (k, own) in met.iter().enumerate() {
        let (mut crowd, mut lacks, mut other) = (1.0, 0.0, (0.0, *own));
        for o in met.iter().enumerate().filter(|(j, _)| *j != k).map(|(_, o)| *o) {
            let c = own.n.dot(&o.n);
            crowd += smooth(0.9, c) * ((own.d - o.d) / 0.1).clamp(-40.0, 40.0).exp();
            let lacking = smooth(0.0, -c) * (1.0 - own.d - o.d);
            clear &= c >= 0.0 || (lacking - lacks).abs() > 1e-3;
            if lacking > lacks {
                (lacks, other) = (lacking, (smooth(0.0, -c), o));
            }
        }
        let d = own.d + 0.5 * lacks;
        let (share, steep, moment) = mirrored(d);
        // ∂(share)/∂(own distance) and by the other's.
        let by_other = -0.5 * other.0 * (steep + grows);
        let by_own = steep + by_other;
        let g = (own.n * by_own + other.1.n * by_other) / h();
        let drift = (own.n.dot(&own.speed) * by_own + other.1.n.dot(&other.1.speed) * by_other) / h();
        shares.push((*own, d, share + 0.5 * grows * lacks, moment, g, drift, 1.0 / crowd));
    }
    let left = |share: f64| (1.0 - share).max(1e-3);
    let free = shares.iter().map(|s| left(s.2).powf(s.6)).product();
    let loose = shares.iter().map(|s| if s.0.sticky { left(s.2).powf(s.6) } else { 1.0 }).product();
    let zero = Vec3::zeros();
    let (slope, lift, squeeze, slide) = (zero, zero, zero, zero);
    let (drift, power, friction, weight, drag) = (0.0, 0.0, 0.0, 0.0, 0.0);
    let mut m = Met { free, slope, drift, lift, squeeze, power, loose, slide, friction, weight, drag };
    for (s, d, share, moment, g, drift, w) in shares {
        clear &= (1.0 - share - 1e-3).abs() > 1e-3 && d.abs() > 1e-3;
        // ∂ of what is taken by this surface's share.
        let counts = w * free / left(share);
        let across = drive.dot(&s.n);
        let raised = s.n * (across.min(0.0) * moment) - (drive - s.n * across) * share;
        m.slope += g * counts;
        m.drift += drift * counts;
        m.lift += raised * counts;
        m.power += raised.dot(&s.speed) * counts;
        m.slide += s.speed * (w * g.norm());
        m.weight += w * g.norm();
        let close = w / (d.max(0.1) * h() * h());
        if s.sticky {
            m.drag -= nu * mirrored(d).1 * close;
        } else {
            m.friction += s.friction * w * g.norm();
            m.squeeze += s.n * (squeezed(d) * close);
        }
    }
    (m, clear)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let clock: Clock = b.one("clock");
    let (time, sound) = (f64::from(clock.frame_start + clock.t), f64::from(clock.wave_speed));
    let says = |name: &str| call.constants.clone().with(name, 1.0) == call.constants;
    let (solved, shifts) = (says("INCOMPRESSIBLE"), says("SHIFTS"));
    let numbers: Vec<u32> = b.get("numbers");
    let (were, debts): (Vec<Debt>, Vec<Debt>) = (b.get("debts"), out.get("debts"));
    let (places, moves, warm): (Vectors, Vectors, Vectors) = (b.get("places"), b.get("moves"), b.get("warm"));
    let (crowds, bodies): (Vec<Crowd>, Vec<Body>) = (b.get("crowds"), b.get("bodies"));
    let (forces, colliders): (Forces, Colliders) = (b.one("forces"), b.one("colliders"));
    let (points, flows): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (out.get("points"), out.get("flows"));
    let locals: Vec<Local> = out.get("locals");
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let ends = clock.frame_length < 0.26;
    let (mut sunk, mut doubts) = (0, false);
    for i in 0..placed {
        let (x, v, crowd) = (vec3(&places[i]), vec3(&moves[i]), &crowds[i]);
        let body = &bodies[moves[i][3].to_bits() as usize & 0xff];
        let (density, nu) = (f64::from(places[i][3]), f64::from(body.mu));
        let (drive, doubtful) = force::acceleration(&forces, body, x, v, time);
        let near = near(&colliders, x, time);
        let (mut m, sure) = meet(&near, drive, nu, if solved { 0.57 } else { 1.0 });
        // What walls on both sides take of a particle by itself is not asked back.
        let (alone, way) = (weight_at(0.0) - m.free, m.slope.norm() / m.weight.max(1e-20));
        let held = if solved && near.len() > 1 && alone > 0.0 { 1.0 - smooth_to(0.3, way) } else { 0.0 };
        m.drift *= 1.0 - held;
        let clear = sure && !doubtful && (alone.abs() > 1e-3 || near.len() < 2);
        let Met { free, slope, drift, lift, squeeze, power, loose, slide, friction, weight, drag } = m;
        let deepest = near.iter().map(|s| s.d).fold(0.0, f64::min);
        let tag = moves[i][3].to_bits();
        sunk += u32::from(ends && deepest < -0.5 && tag & (PINNED | LED) == 0);
        doubts |= (deepest + 0.5).abs() < 1e-3;
        let was = &were[numbers[i] as usize];
        let [debt, noted] = [was.owed, was.noted].map(f64::from);
        let owed = match (shifts, noted > 0.0) {
            (false, _) => 0.0,
            (true, false) => debt,
            (true, true) => debt + f64::from(crowd.fill) - noted,
        };
        let fill = f64::from(crowd.fill) + 1.0 - free - owed - held * alone;
        let within = if shifts { inside(h() * (vec3(&crowd.slope) + slope).norm()) } else { 0.0 };
        let over = fill.powi(7) - 1.0;
        let over = if over < 0.0 { within * over } else { over };
        let tait = density * sound * sound / 7.0 * over / fill.powi(2);
        let pressed = if solved { f64::from(warm[i][2] + warm[i][3]) } else { tait };
        let full = (pressed / (0.25 * density * h() * drive.norm())).clamp(0.0, 1.0);
        let around = vec3(&crowd.slope);
        let own = (around + slope).dot(&(around / steep() + slope)).max(0.0) / density;
        let response = (own + f64::from(crowd.coupling) / steep()).max(0.05 / (density * h() * h()));
        let all = drive + lift * full;
        let mean = |sum: f64| if weight > 0.0 { sum / weight } else { 0.0 };
        let l = &locals[i];
        if !clear {
            continue; // on a border, where rounding decides
        }
        let steepest = 4.0 / h();
        let shears = (f64::from(crowd.fill) + 1.0 - loose).min(f64::from(crowd.fill) / loose);
        let thickness = nu / (1.0 - sheared() * (1.0 - shears)).max(0.5 * shears);
        got.extend(
            [points[i][3], flows[i][3], l.drift, l.fill, l.friction, l.response, l.drag, l.density].map(f64::from),
        );
        got.extend([debts[numbers[i] as usize].owed, debts[numbers[i] as usize].head].map(f64::from));
        want.extend([tait, thickness * density, drift, fill, mean(friction), response, drag, density]);
        want.extend([if shifts { owed } else { debt }, if shifts { pressed / density } else { 7.0 }]);
        let thick = nu * density * (1.0 + 1.0 / shears) / shears;
        let stiff = density * sound * sound * (fill.powi(5) + if over < 0.0 { 4.0 / 7.0 / fill.powi(2) } else { 0.0 });
        // Its mean is one of slopes, of which those far from all surfaces are small.
        let rubs = (0.05 * steepest / weight.max(1e-9)).max(1.0);
        scale.extend([stiff, thick, steepest * 3.0, fill, rubs]);
        scale.extend([
            (around.norm() + steepest).powi(2) / density + response,
            drag + nu * 10.0 / (h() * h()),
            density,
        ]);
        scale.extend([1.0, stiff / density + pressed.abs() / density]);
        got.push(l.power.into());
        want.push(power * full);
        scale.push(drive.norm() * 40.0 * 3.0);
        for (a, b, size) in [
            (l.wall, slope, steepest),
            (l.drive, all, drive.norm() * 40.0),
            (l.slide, Vec3::from_fn(|a, _| mean(slide[a])), 3.0),
            (l.squeeze, squeeze * (full * thickness), thick / density * 20.0 / (h() * h())),
        ] {
            got.extend(a.map(f64::from));
            want.extend(b.iter());
            scale.extend([size; 3]);
        }
    }
    let kept = (0..placed).all(|i| {
        points[i][..3] == places[i][..3] && flows[i][..3] == moves[i][..3] && locals[i].tag == moves[i][3].to_bits()
    });
    let counted = out.one::<Clock>("clock").sunk;
    vec![
        Compared::close("surroundings", got, want, scale),
        Compared::fact("places and velocities are kept", kept),
        Compared::fact("what is deep in an obstacle is counted", counted == sunk || doubts),
    ]
}

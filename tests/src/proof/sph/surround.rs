//! Proof of `sph/surround`: walls as mirror images, gravity and fields, Tait's pressure ρ c²/7 (s⁷ − 1) ≥ 0 over s², the
//! response A = (max((S + w)·(S/steep + w), 0) + Σ|V∇W|²/steep)/ρ.

use nalgebra::{Rotation3, Unit};
use physvideo_gpu::kernels::{Body, Clock, Collider, Colliders, Counts, Crowd, Debt, Forces, Local, family::shape};

use super::spread::inside;
use super::wall::{mirrored, squeezed};
use super::{Liquid, Vec3, Vectors, h, sheared, steep, vec3};
use crate::proof::mpm::force;
use crate::proof::mpm::obstacle::obstacles;
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "sph/surround",
    inputs,
    compare,
    tolerance: 3e-5,
    reason: "distances are known to 1e-7 m, 5e-6 h, and slopes have derivatives up to 4/h²; s⁷ − 1 multiplies what s has \
             by 7; each relative to the size of its terms",
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
    }
    for crowd in &mut liquid.crowds {
        crowd.slope = crowd.slope.map(|c| 0.5 * c);
    }
    let moves: Vec<[f32; 4]> = liquid.vectors(|r| {
        let v = r.vector(2.0);
        [v[0], v[1], v[2], f32::from_bits(r.below(2) as u32)]
    });
    let warm = liquid.vectors(|r| [1.0, 1.0, r.range(0.0, 60.0), if r.chance(0.5) { 0.0 } else { r.range(0.0, 60.0) }]);
    let bodies = [
        Body { fields: 0b1011, mu: 5e-3, gravity: [0.1, 0.2, -9.81], ..Default::default() },
        Body { fields: 0b0101, mu: 0.2, gravity: [0.0, -3.0, 0.5], ..Default::default() },
    ];
    // A room that turns so fast that the work of two of its walls in a corner shows.
    let mut colliders = obstacles();
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
    liquid
        .call()
        .constant("INCOMPRESSIBLE", (ask.seed % 2) as f64)
        .constant("SHIFTS", (ask.seed / 2 % 2) as f64)
        .with("moves", &moves)
        .with("warm", &warm)
        .with("bodies", &bodies)
        .with("forces", &[force::forces()])
        .with("colliders", &[colliders])
        .with("numbers", &numbers)
        .with("debts", &debts)
        .with("points", &vec![[0.0f32; 4]; n])
        .with("flows", &vec![[0.0f32; 4]; n])
        .with("locals", &vec![Local::default(); n])
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
            (0..3).map(|a| (-q[a] / h(), -Vec3::ith(a, sign[a]), 1.0)).collect()
        }
        _ => vec![],
    }
}

fn face(q: Vec3, sign: Vec3) -> (f64, Vec3, f64) {
    let a = q.imax();
    let next = (0..3).filter(|i| *i != a).map(|i| q[i]).fold(f64::NEG_INFINITY, f64::max);
    (q[a] / h(), Vec3::ith(a, sign[a]), (q[a] - next) / h())
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
    for i in 0..placed {
        let (x, v, crowd) = (vec3(&places[i]), vec3(&moves[i]), &crowds[i]);
        let body = &bodies[moves[i][3].to_bits() as usize];
        let (density, nu) = (f64::from(places[i][3]), f64::from(body.mu));
        let (drive, doubtful) = force::acceleration(&forces, body, x, v, time);
        let (mut free, mut slope, mut drift, mut lift) = (1.0, Vec3::zeros(), 0.0, Vec3::zeros());
        let (mut squeeze, mut power) = (Vec3::zeros(), 0.0);
        let (mut loose, mut slide, mut friction, mut weight, mut drag, mut clear) =
            (1.0, Vec3::zeros(), 0.0, 0.0, 0.0, !doubtful);
        for c in &colliders.d[..colliders.count as usize] {
            let (start, end) = (f64::from(c.start), f64::from(c.end));
            let moved = time.clamp(start, end) - start;
            let spin = vec3(&c.spin);
            let turn = Unit::try_new(spin, 0.0)
                .map_or_else(Rotation3::identity, |axis| Rotation3::from_axis_angle(&axis, spin.norm() * moved));
            let r = x - (vec3(&c.center) + vec3(&c.velocity) * moved);
            let running = time >= start && time < end;
            let speed = if running { vec3(&c.velocity) + spin.cross(&r) } else { Vec3::zeros() };
            for (d, n, tie) in surfaces(c, turn.inverse() * r) {
                clear &= d.abs() > 1e-3 && tie > 1e-3 && (d - 1.0).abs() > 1e-3;
                if d >= 1.0 {
                    continue;
                }
                let n = turn * n;
                let (share, s, moment) = mirrored(d);
                let left = (1.0 - share).max(0.0);
                clear &= (1.0 - share).abs() > 1e-3;
                let g = n * (s / h());
                slope = slope * left + g * free;
                drift = drift * left + speed.dot(&g) * free;
                let across = drive.dot(&n);
                let raised = n * (across.min(0.0) * moment) - (drive - n * across) * share;
                lift = lift * left + raised * free;
                power = power * left + raised.dot(&speed) * free;
                free *= left;
                slide += speed * g.norm();
                weight += g.norm();
                if c.sticky == 1 {
                    loose *= left;
                    drag -= nu * s / (d.max(0.1) * h() * h());
                } else {
                    friction += f64::from(c.friction) * g.norm();
                    squeeze += n * (squeezed(d) / (d.max(0.1) * h() * h()));
                }
            }
        }
        let was = &were[numbers[i] as usize];
        let [debt, noted] = [was.owed, was.noted].map(f64::from);
        let owed = match (shifts, noted > 0.0) {
            (false, _) => 0.0,
            (true, false) => debt,
            (true, true) => debt + f64::from(crowd.fill) - noted,
        };
        let fill = f64::from(crowd.fill) + 1.0 - free - owed;
        let within = if shifts { inside(h() * (vec3(&crowd.slope) + slope).norm()) } else { 0.0 };
        let over = fill.powi(7) - 1.0;
        let over = if over < 0.0 { within * over } else { over };
        let tait = density * sound * sound / 7.0 * over / fill.powi(2);
        let pressed = if solved { f64::from(warm[i][2] + warm[i][3]) } else { tait };
        let full = (pressed / (0.25 * density * h() * drive.norm())).clamp(0.0, 1.0);
        let around = vec3(&crowd.slope);
        let own = (around + slope).dot(&(around / steep() + slope)).max(0.0) / density;
        let response = own + f64::from(crowd.coupling) / steep();
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
    vec![Compared::close("surroundings", got, want, scale), Compared::fact("places and velocities are kept", kept)]
}

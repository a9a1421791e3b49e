//! Proof of `sph/advance`: Coulomb's friction, the speed limit h/dt, x + dt v, by the particles' numbers
//! and where the step found them; the work of walls that move, m dt (power − P drift/ρ) and impulses along them times their
//! velocity.

use physvideo_gpu::kernels::{Body, Clock, Counts, Keep, Local};

use super::{Liquid, Vec3, h, vec3};
use crate::proof::cloud::{LED, PINNED};
use crate::proof::work::{Work, begun};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/advance",
    inputs,
    compare,
    tolerance: 3e-6,
    reason: "a few products and square roots in f32; relative to the speeds that are taken from each other",
    unordered: &[],
    bytes: 100.0 + 52.0 + 48.0,
    flops: 60.0,
};

fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let n = ask.items;
    let pressures = liquid.vectors(|r| [0.0, 0.0, 0.0, r.range(-1e3, 5e3)]);
    let points: Vec<[f32; 4]> = liquid.places.iter().zip(&pressures).map(|(x, p)| [x[0], x[1], x[2], p[3]]).collect();
    let flows = liquid.vectors(|r| {
        let most = if r.chance(0.1) { 30.0 } else { 3.0 };
        let v = r.vector(most);
        [v[0], v[1], v[2], 1.0]
    });
    // One has lost its way where the inputs are poisoned.
    let mut flows = flows;
    if ask.poison {
        flows[0][1] = f32::NAN;
    }
    let mut numbers: Vec<u32> = (0..n as u32).collect();
    liquid.random.shuffle(&mut numbers);
    let stirs: Vec<f32> = (0..n).map(|_| liquid.random.range(0.0, 1e3)).collect();
    let mut locals = liquid.locals();
    for own in &mut locals {
        own.tag |= if liquid.random.chance(0.5) { LED } else { 0 };
    }
    // Clear of the nozzles' ends, where rounding decides.
    let ended = |own: &Local, x: &[f32; 4]| {
        let body = bodies()[(own.tag & 0xff) as usize];
        (vec3(&body.p[1..]).dot(&vec3(x)) - f64::from(body.lambda)).abs() < 1e-5
    };
    for (own, x) in locals.iter_mut().zip(&points) {
        own.tag &= if ended(own, x) { !LED } else { u32::MAX };
    }
    let call = liquid.call();
    let clock = begun(call.buffers.one("clock"));
    call.with("clock", &[clock])
        .with("points", &points)
        .with("flows", &flows)
        .with("locals", &locals)
        .with("numbers", &numbers)
        .with("stirs", &stirs)
        .with("particles", &vec![[5.0f32; 4]; 6 * n])
        .with("bodies", &bodies())
        .with("moves", &vec![[5.0f32; 4]; n])
        .with("warm", &vec![[5.0f32; 4]; n])
        .with("keep", &[Keep { drift: [0.4, -0.3, 0.2], low: [u32::MAX; 3], ..Default::default() }])
        .constant("NOZZLES", (ask.seed % 2) as f64)
        .constant("IMPLICIT", (ask.seed % 4 / 2) as f64)
        .constant("COUNTS_WORK", f64::from(u8::from(!ask.seed.is_multiple_of(4))))
}

/// Three bodies, of which the last has no nozzle.
fn bodies() -> Vec<Body> {
    let nozzle = |v: [f32; 3], lambda| Body { p: [9.0, v[0], v[1], v[2]], lambda, ..Default::default() };
    vec![nozzle([1.0, -0.5, 2.0], 0.45), nozzle([0.0, 0.0, -1.5], -0.2), nozzle([0.0; 3], 0.0)]
}

/// A number as a word, so that words are ordered as the numbers are.
pub fn ranked(x: f32) -> u32 {
    let bits = x.to_bits();
    if x.is_sign_negative() { !bits } else { bits | 1 << 31 }
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let dt = f64::from(b.one::<Clock>("clock").dt);
    let (points, flows): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (b.get("points"), b.get("flows"));
    let (locals, numbers): (Vec<Local>, Vec<u32>) = (b.get("locals"), b.get("numbers"));
    let stirs: Vec<f32> = b.get("stirs");
    let says = |name: &str| call.constants.clone().with(name, 1.0) == call.constants;
    let (nozzles, implicit, works) = (says("NOZZLES"), says("IMPLICIT"), says("COUNTS_WORK"));
    let all: Vec<Body> = b.get("bodies");
    let particles: Vec<[f32; 4]> = out.get("particles");
    let [places, moves, warm]: [Vec<[f32; 4]>; 3] = ["places", "moves", "warm"].map(|name| out.get(name));
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    // Workgroups without particles report the speed of sound alone.
    let (mut clamped, mut fastest, mut tags) = (0, f64::from(b.one::<Clock>("clock").wave_speed), true);
    let (mut alike, mut lost, mut apart) = (true, 0, 0.0);
    let (mut sample, mut done) = (Vec::new(), Work::default());
    for i in 0..placed {
        let own = &locals[i];
        let (mut v, wall) = (vec3(&flows[i]), vec3(&own.wall));
        let (found, stir) = (f64::from(points[i][3]), f64::from(stirs[i]));
        let size = v.norm() + vec3(&own.slide).norm();
        let (density, fill) = (f64::from(own.density), f64::from(own.fill));
        let (mass, slide) = (density * h().powi(3), vec3(&own.slide));
        // What walls give: power, pressure, drag and friction, each times their velocity.
        let pushed = (found + stir) * f64::from(own.drift) / density;
        done.add(
            mass * dt * (f64::from(own.power) - pushed),
            mass * dt * (f64::from(own.power.abs()) + pushed.abs()),
            true,
        );
        if implicit && own.tag & PINNED == 0 {
            let over = v - slide;
            let squeeze = vec3(&own.squeeze);
            let along = squeeze.try_normalize(0.0).unwrap_or_default();
            let rate = over * f64::from(own.drag) + squeeze * along.dot(&over);
            let most = size * (f64::from(own.drag) + squeeze.norm()) * slide.norm();
            done.add(-mass * dt * rate.dot(&slide), mass * dt * most, true);
        }
        if own.friction > 0.0 && wall.norm() > 0.0 {
            let n = wall.normalize();
            let over = v - vec3(&own.slide);
            let slip = over - n * over.dot(&n);
            let most = f64::from(own.friction) * dt * (found + stir).max(0.0) * wall.norm() / density;
            let lost = if slip.norm() > most { slip.normalize() * most } else { slip };
            v -= lost;
            done.add(-mass * lost.dot(&slide), mass * size * slide.norm(), true);
        }
        if v.norm() > h() / dt {
            clamped += 1;
            v = v.normalize() * (h() / dt);
        }
        if own.tag & PINNED != 0 {
            v = Vec3::zeros();
        }
        let mut tag = own.tag;
        if nozzles && tag & LED != 0 {
            let body = &all[(tag & 0xff) as usize];
            if vec3(&body.p[1..]).dot(&vec3(&points[i])) < f64::from(body.lambda) {
                let led = vec3(&body.p[1..]);
                let size = mass * (led.norm_squared() + v.norm_squared());
                done.add(0.5 * mass * (led.norm_squared() - v.norm_squared()), size, true);
                v = led;
            } else {
                tag &= !LED;
            }
        }
        let p = &particles[6 * numbers[i] as usize..][..6];
        if !v.iter().all(|c| c.is_finite()) {
            lost += 1;
            continue;
        }
        alike &= places[i][..3] == p[0][..3] && places[i][3] == own.density && warm[i] == p[5];
        alike &= moves[i][..3] == p[1][..3] && moves[i][3].to_bits() == p[0][3].to_bits();
        apart = f64::max(apart, (v - vec3(&b.one::<Keep>("keep").drift)).norm());
        if numbers[i] % 64 == 0 {
            sample.push(p[1]);
        }
        fastest = fastest.max(v.norm() + f64::from(b.one::<Clock>("clock").wave_speed));
        let x = vec3(&points[i]) + v * dt;
        got.extend([p[0], p[1]].iter().flat_map(|r| r[..3].to_vec()).chain(p[5]).map(f64::from));
        got.push(p[1][3].into());
        want.extend(x.iter().chain(v.iter()));
        want.extend([fill, (found + stir) * fill * fill, found, stir, density * h().powi(3)]);
        scale.extend([0.3, 0.3, 0.3, size, size, size, fill, (found.abs() + stir) * fill * fill, found.abs(), stir]);
        scale.push(density * h().powi(3));
        tags &= p[0][3].to_bits() == tag && (2..5).all(|k| p[k] == [5.0; 4]);
    }
    let (clock, keep): (Clock, Keep) = (out.one("clock"), out.one("keep"));
    let extreme = |start: u32, of: fn(u32, u32) -> u32| -> [u32; 3] {
        std::array::from_fn(|a| sample.iter().map(|v| ranked(v[a])).fold(start, of))
    };
    vec![
        Compared::close("particles", got, want, scale),
        Compared::fact("tags are kept, and what is not theirs", tags),
        Compared::fact("the next step may begin with the same", alike),
        Compared::equal("what is not finite ends the lists", &[keep.spent], &[lost.min(1)]),
        Compared::near(
            "beyond the common velocity",
            vec![f32::from_bits(keep.apart).into()],
            vec![apart],
            apart + 1e-9,
        ),
        Compared::equal("least of the sample", &keep.low, &extreme(u32::MAX, u32::min)),
        Compared::equal("largest of the sample", &keep.high, &extreme(0, u32::max)),
        done.compare(&b.one("clock"), &clock, works, CASE.tolerance),
        Compared::equal("too fast", &[clock.clamped_velocity], &[clamped]),
        Compared::near("fastest", vec![f32::from_bits(clock.speed_bits).into()], vec![fastest], fastest + 1e-9),
    ]
}

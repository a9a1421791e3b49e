//! Proof of `lagrangian/contact`: pressure for depth, soft at first, much steeper from half a cell on, that of a shock, a
//! Coulomb-limited spring along the surface, glue.

use nalgebra::{Rotation3, Unit};
use physvideo_gpu::kernels::{Clock, Collider, Colliders, ElasticCell, Skin, Solid};

use super::{Bodies, DX, WAVE, at_point, cofactor, give, hurry, quarter, rebound, solids};
use crate::proof::mpm::{Mat3, Vec3, obstacle, vec3};
use crate::proof::work::{Work, begun};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/contact",
    inputs,
    compare,
    tolerance: 4e-6,
    reason: "depths are differences of places of half a metre (6e-8 each, ten of them) times stiffness and area; turns by \
             sine and cosine add as much",
    unordered: &[],
    bytes: 1100.0,
    flops: 1500.0,
};

const TIME: f64 = 0.7;

fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mut random = Random::new(ask.seed ^ 0xc0);
    // Into the middle of the obstacles.
    let shift: [f64; 3] = [-0.2, 0.2, 0.15];
    b.skins.iter_mut().for_each(|s| (0..3).for_each(|a| s.x[a] += shift[a] as f32));
    if ask.poison && !b.u.is_empty() {
        b.u[0] = [f32::NAN; 4];
    }
    let all = obstacle::obstacles();
    // Where each took hold: near where it is now, on any of the obstacles or none.
    let grips: Vec<[f32; 4]> = b
        .skins
        .iter()
        .map(|s| {
            let k = random.below(all.count as usize + 1);
            if k == 0 {
                return [0.0; 4];
            }
            let motion = Motion::new(&all.d[k - 1]);
            let x = vec3(&s.x) + vec3(&random.vector(0.02));
            let r = motion.turn.inverse() * (x - motion.center);
            [r[0] as f32, r[1] as f32, r[2] as f32, k as f32]
        })
        .collect();
    let clock = Clock { wave_speed: WAVE as f32, frame_start: 0.5, t: 0.2, dt: 1e-3, ..Default::default() };
    Call::new(b.skins.len().div_ceil(64) + 1)
        .immediates(&b.sizes)
        .with("cells", &b.cells)
        .with("solids", &solids())
        .with("skins", &b.skins)
        .with("u", &b.u)
        .with("v", &b.v)
        .with("colliders", &[all])
        .with("grips", &grips)
        .same("grips_was", "grips")
        .with("pushes", &vec![[f32::NAN; 4]; 4 * b.skins.len()])
        .constant("COUNTS_WORK", (ask.seed % 2) as f64)
        .constant("CURVED", f64::from(u8::from(ask.seed % 4 < 2)))
        .with("clock", &[begun(clock)])
}

/// Where an obstacle is, and how it moves.
pub(super) struct Motion {
    pub center: Vec3,
    pub turn: Rotation3<f64>,
    pub drift: Vec3,
    pub spin: Vec3,
}

impl Motion {
    pub fn new(c: &Collider) -> Self {
        let (start, end) = (f64::from(c.start), f64::from(c.end));
        let moved = TIME.clamp(start, end) - start;
        let (drift, spin) = (vec3(&c.velocity), vec3(&c.spin));
        let turn = Unit::try_new(spin, 0.0)
            .map_or_else(Rotation3::identity, |axis| Rotation3::from_axis_angle(&axis, spin.norm() * moved));
        let running = if TIME >= start && TIME < end { 1.0 } else { 0.0 };
        Self { center: vec3(&c.center) + drift * moved, turn, drift: running * drift, spin: running * spin }
    }
}

impl Motion {
    /// Velocity of the obstacle at x.
    pub fn velocity(&self, x: Vec3) -> Vec3 {
        self.drift + self.spin.cross(&(x - self.center))
    }

    /// Its surfaces as x sees them: distance, outward normal, by how much the choice of it was unique.
    pub fn faces(&self, c: &Collider, x: Vec3) -> Vec<(f64, Vec3, f64)> {
        let turned = |(gap, n, tie)| (gap, self.turn * n, tie);
        obstacle::shape(c.shape, vec3(&c.size), self.turn.inverse() * (x - self.center))
            .into_iter()
            .map(turned)
            .collect()
    }
}

/// What the law says of one point: forces at the point and its faces, where the faces are, energy, grip, fastest approach.
#[derive(Default)]
struct Law {
    own: Vec3,
    faces: [Vec3; 3],
    energy: f64,
    grip: Option<(usize, Vec3)>,
    approach: f64,
    /// Depth one step on [m].
    deepest: f64,
    /// Sum of forces times the obstacles' velocities, and of their sizes [W].
    power: (f64, f64),
    /// A decision on the way was close to going the other way.
    close: bool,
}

fn law(
    all: &Colliders,
    solid: &Solid,
    skin: &Skin,
    cell: &ElasticCell,
    fields: [&[[f32; 4]]; 2],
    held: &[f32; 4],
    curved: bool,
) -> Law {
    let mut law = Law::default();
    let place = quarter(skin.point & 7);
    let (u, slope) = at_point(cell, fields[0], place);
    let speed = at_point(cell, fields[1], place).0;
    let x = vec3(&skin.x) + u;
    let cof = cofactor(&(Mat3::identity() + slope));
    let k = f64::from(solid.stiffness);
    let face = 0.25 * DX * DX;
    let mut firmest = 0.0;
    let mut rub = (Vec3::zeros(), [0.0; 3], 0.0, Vec3::zeros());
    for (i, c) in all.d[..all.count as usize].iter().enumerate() {
        let motion = Motion::new(c);
        for (wall, (gap, n, tie)) in motion.faces(c, x).into_iter().enumerate() {
            law.close |= tie < 1e-5;
            let velocity = motion.velocity(x);
            let approach = -(speed - velocity).dot(&n);
            let reach = 0.25 * DX + 2.0 * approach.abs() * 1e-3;
            law.close |= (gap - reach).abs() < 1e-5 || approach.abs() < 1e-5;
            if gap < reach {
                law.approach = law.approach.max(approach.abs() + 2.0 * hurry(approach, WAVE));
            }
            let mut press = [0.0; 3];
            let (mut normals, mut speeds) = ([n; 3], [velocity; 3]);
            let mut deepest = 0.0f64;
            let mut area = 0.0;
            for axis in 0..3 {
                let s = cof.column(axis).dot(&n);
                law.close |= s.abs() < 1e-5;
                // The face that looks against the normal.
                let way = if s > 0.0 { -1.0 } else { 1.0 };
                let bit = if s > 0.0 { 8 + axis } else { 11 + axis };
                if skin.tag >> bit & 1 == 0 {
                    continue;
                }
                // Areas as a face is turned or pressed change by the second order at first.
                let side = face * (1.0 - (1.0 - s.abs().min(1.0)).powi(2));
                area += side;
                law.close |= (s.abs() - 1.0).abs() < 1e-5;
                let mut there = place;
                there[axis] += 0.25 * way;
                let mut rest = vec3(&skin.x);
                rest[axis] += 0.25 * way * DX;
                let face_at = rest + at_point(cell, fields[0], there).0;
                let depth = if curved {
                    let (gap, n, tie) = motion.faces(c, face_at)[wall];
                    law.close |= tie < 1e-5;
                    (normals[axis], speeds[axis]) = (n, motion.velocity(face_at));
                    -gap
                } else {
                    // It is flat between a point and its face.
                    -(gap + (face_at - x).dot(&n))
                };
                law.close |= depth.abs() < 1e-6;
                let depth = depth.max(0.0);
                let (pressed, stored) = give(depth, 0.06 * DX, 0.5 * DX);
                press[axis] = k * side * pressed * rebound(approach, WAVE);
                if depth > 0.0 {
                    let damped = k * f64::from(solid.damping) * approach.max(0.0);
                    press[axis] += side * (1.5 * f64::from(solid.density) * hurry(approach, WAVE).powi(2) + damped);
                }
                if c.sticky == 0 {
                    law.energy += k * side * stored;
                    deepest = deepest.max(depth);
                }
            }
            let total: f64 = press.iter().sum();
            let mine = held[3] == (i + 1) as f32;
            let slid = if mine { x - motion.center - motion.turn * vec3(held) } else { Vec3::zeros() };
            let own = |x: Vec3| motion.turn.inverse() * (x - motion.center);
            if c.sticky != 0 {
                if total > 0.0 || mine {
                    law.own -= k * face * slid;
                    law.power.0 -= k * face * slid.dot(&velocity);
                    law.power.1 += k * face * (slid.norm() + x.norm()) * velocity.norm();
                    law.energy += 0.5 * k * face * slid.norm_squared();
                    law.grip = Some((i + 1, own(x - slid)));
                    rub = Default::default();
                    firmest = f64::INFINITY;
                }
                continue;
            }
            (0..3).for_each(|a| law.faces[a] += press[a] * normals[a]);
            law.power.0 += (0..3).map(|a| press[a] * normals[a].dot(&speeds[a])).sum::<f64>();
            law.power.1 += (total + k * area * x.norm()) * velocity.norm();
            if total > 0.0 {
                law.deepest = law.deepest.max(deepest + approach.abs() * 1e-3);
            }
            law.close |= total > 0.0 && (total - firmest).abs() < 1e-5 * total;
            if total > firmest {
                firmest = total;
                let along = slid - n * slid.dot(&n);
                // Coulomb: the spring pulls by μ times the pressure at most, and slips where it would pull more.
                let pull = (k * area * along.norm()).min(f64::from(c.friction) * total);
                let stretch = pull / (k * area);
                let direction = along.try_normalize(0.0).unwrap_or_else(Vec3::zeros);
                rub = (-pull * direction, press.map(|p| p / total), 0.5 * k * area * stretch * stretch, velocity);
                law.grip = Some((i + 1, own(x - stretch * direction)));
            }
        }
    }
    (0..3).for_each(|a| law.faces[a] += rub.1[a] * rub.0);
    law.energy += rub.2;
    law.power.0 += rub.0.dot(&rub.3);
    law.power.1 += rub.0.norm() * rub.3.norm();
    law
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, skins): (Vec<ElasticCell>, Vec<Skin>) = (input.get("cells"), input.get("skins"));
    let solids: Vec<Solid> = input.get("solids");
    let all: Colliders = input.one("colliders");
    let (u, v): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("v"));
    let held: Vec<[f32; 4]> = input.get("grips");
    let (pushes, grips): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (out.get("pushes"), out.get("grips"));
    let clock: Clock = out.one("clock");
    let [counts, curved] = ["COUNTS_WORK", "CURVED"].map(|f| call.constants.clone().with(f, 1.0) == call.constants);
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut fastest, mut sound) = (0.0f64, true);
    let mut holds = (Vec::new(), Vec::new());
    let mut done = Work::default();
    for (i, skin) in skins.iter().enumerate() {
        let solid = &solids[(skin.tag & 0xff) as usize];
        let cell = &cells[(skin.point >> 3) as usize];
        let law = law(&all, solid, skin, cell, [&u, &v], &held[i], curved);
        let finite = law.own.iter().chain(law.faces.iter().flatten()).all(|c| c.is_finite()) && law.energy.is_finite();
        let finite = finite && at_point(cell, &u, quarter(skin.point & 7)).0.iter().all(|c| c.is_finite());
        // Half of this step and half of the last, which nodes keep.
        let kick = 0.5 * (1e-3 + f64::from(v[0][3]));
        done.add(kick * law.power.0, kick * law.power.1, !law.close && finite);
        if law.close || !finite {
            sound = false;
            continue;
        }
        if law.approach > 0.0 || law.deepest > 0.0 {
            // c √((1 + p')/2), p' the slope of the pressure over that at no depth.
            let stiff = (1.0 + 2.5 * (law.deepest / (0.5 * DX)).powi(4)).sqrt();
            fastest = fastest.max(WAVE * stiff + law.approach);
        }
        // Stiffness times area times a metre.
        let firm = 1.0 + (law.deepest / (0.5 * DX)).powi(4);
        let size = f64::from(solid.stiffness) * 0.25 * DX * DX * 2.0 * firm;
        let mut add = |g: &[f64], w: &[f64], size: f64| {
            got.extend(g);
            want.extend(w);
            scale.extend(std::iter::repeat_n(size, w.len()));
        };
        add(vec3(&pushes[4 * i]).as_slice(), law.own.as_slice(), size);
        add(&[f64::from(pushes[4 * i][3])], &[law.energy], size);
        for a in 0..3 {
            add(vec3(&pushes[4 * i + 1 + a]).as_slice(), law.faces[a].as_slice(), size);
        }
        let (number, at) = law.grip.unwrap_or_default();
        holds.0.push(grips[i][3] as u32);
        holds.1.push(number as u32);
        add(vec3(&grips[i]).as_slice(), at.as_slice(), 1.0);
    }
    let mut facts = vec![
        Compared::close("forces, energy and grips", got, want, scale),
        Compared::equal("which obstacle is held", &holds.0, &holds.1),
        done.compare(&input.one("clock"), &clock, counts, CASE.tolerance),
    ];
    if sound {
        let speed = f64::from(f32::from_bits(clock.speed_bits));
        facts.push(Compared::near("fastest approach", vec![speed], vec![fastest], 10.0 + fastest));
    }
    facts
}

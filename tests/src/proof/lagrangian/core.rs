//! Proof of `lagrangian/core`: points inside a body are pushed out of obstacles by the law of its surface.

use physvideo_gpu::kernels::{Clock, Colliders, ElasticCell, ElasticNode, Solid};

use super::contact::Motion;
use super::{Bodies, DX, WAVE, around, at_point, give, hurry, quarter, rebound, solids, weight};
use crate::proof::mpm::{Vec3, obstacle, vec3};
use crate::proof::work::{Work, begun};
use crate::proof::{Ask, Buffers, Call, Case, Compared};
use crate::random::Random;

pub static CASE: Case = Case {
    kernel: "lagrangian/core",
    inputs,
    compare,
    tolerance: 4e-6,
    reason: "depths are differences of places of half a metre (6e-8 each, ten of them) times stiffness and area; turns by \
             sine and cosine add as much",
    unordered: &[],
    bytes: 1300.0,
    flops: 6000.0,
};

fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    let mut random = Random::new(ask.seed ^ 0xc04e);
    // Into the middle of the obstacles.
    let shift: [f32; 3] = [-0.2, 0.2, 0.15];
    b.nodes.iter_mut().for_each(|n| (0..3).for_each(|a| n.x[a] += shift[a]));
    if ask.poison && !b.u.is_empty() {
        b.u[0] = [f32::NAN; 4];
    }
    let shares: Vec<[f32; 4]> =
        (0..27 * b.cells.len()).map(|_| random.vector(0.5)).map(|[x, y, z]| [x, y, z, 0.0]).collect();
    let clock = Clock { wave_speed: WAVE as f32, frame_start: 0.5, t: 0.2, dt: 1e-3, ..Default::default() };
    Call::new(b.cells.len().div_ceil(64) + 1)
        .immediates(&b.sizes)
        .with("cells", &b.cells)
        .with("nodes", &b.nodes)
        .with("solids", &solids())
        .with("u", &b.u)
        .with("v", &b.v)
        .with("colliders", &[obstacle::obstacles()])
        .with("shares", &shares)
        .same("shares_was", "shares")
        .with("energies", &vec![f32::NAN; b.cells.len()])
        .constant("COUNTS_WORK", (ask.seed % 2) as f64)
        .with("clock", &[begun(clock)])
}

/// What the law says of one point.
#[derive(Default)]
struct Law {
    force: Vec3,
    energy: f64,
    /// Force times the obstacles' velocity, and their sizes [W].
    power: (f64, f64),
    approach: f64,
    /// Depth one step on [m].
    deepest: f64,
    /// A decision on the way was close to going the other way.
    close: bool,
}

fn law(all: &Colliders, solid: &Solid, x: Vec3, speed: Vec3) -> Law {
    let mut law = Law::default();
    let (k, area) = (f64::from(solid.stiffness), DX * DX / 4.0);
    for c in &all.d[..all.count as usize] {
        let motion = Motion::new(c);
        for (gap, n, tie) in motion.faces(c, x) {
            let velocity = motion.velocity(x);
            let approach = -(speed - velocity).dot(&n);
            law.close |= gap.abs() < 1e-6 || (gap < 0.0 && tie < 1e-5);
            if gap >= 0.0 {
                continue;
            }
            let (pressed, stored) = give(-gap, 0.06 * DX, 0.5 * DX);
            let viscous = 1.5 * f64::from(solid.density) * hurry(approach, WAVE).powi(2)
                + k * f64::from(solid.damping) * approach.max(0.0);
            let press = area * (k * pressed * rebound(approach, WAVE) + viscous);
            law.force += press * n;
            law.energy += area * k * stored;
            law.power.0 += press * n.dot(&velocity);
            law.power.1 += (press + k * area * x.norm()) * velocity.norm();
            law.deepest = law.deepest.max(-gap + 1e-3 * approach.abs());
            law.approach = law.approach.max(approach.abs() + 2.0 * hurry(approach, WAVE));
        }
    }
    law
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, solids): (Vec<ElasticCell>, Vec<Solid>) = (input.get("cells"), input.get("solids"));
    let nodes: Vec<ElasticNode> = input.get("nodes");
    let all: Colliders = input.one("colliders");
    let (u, v): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("v"));
    let (was, now): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("shares"), out.get("shares"));
    let energies: Vec<f32> = out.get("energies");
    let clock: Clock = out.one("clock");
    let counts = call.constants.clone().with("COUNTS_WORK", 1.0) == call.constants;
    let (mut got, mut want, mut scale) = (Vec::new(), Vec::new(), Vec::new());
    let (mut fastest, mut sound, mut met) = (0.0f64, true, 0);
    let mut done = Work::default();
    for (i, cell) in cells.iter().enumerate() {
        let solid = &solids[(cell.mask >> 16) as usize];
        let middle = cell.rows[4] as usize + 1;
        let mut sums = [Vec3::zeros(); 27];
        let (mut energy, mut power, mut sure) = (0.0, (0.0, 0.0), true);
        let (mut firm, mut closing) = (0.0f64, 0.0f64);
        for corner in (0..8).filter(|c| cell.mask >> c & 1 == 1) {
            let place = quarter(corner);
            let rest = vec3(&nodes[middle].x) + Vec3::from_fn(|a, _| place[a] * DX);
            let x = rest + at_point(cell, &u, place).0;
            let law = law(&all, solid, x, at_point(cell, &v, place).0);
            sure &= !law.close && x.iter().all(|c| c.is_finite());
            for (sum, s) in sums.iter_mut().zip(around()) {
                *sum += weight(s, place) * law.force;
            }
            energy += law.energy;
            power = (power.0 + law.power.0, power.1 + law.power.1);
            if law.deepest > 0.0 {
                met += 1;
                let deep = (law.deepest / (0.5 * DX)).powi(4);
                firm = firm.max(deep);
                closing = closing.max(law.approach);
            }
        }
        if closing > 0.0 {
            // The surface's springs and these each add what a filled lattice has by itself: c √(3/2) at no depth.
            fastest = fastest.max(WAVE * (1.5 + 2.5 * firm).sqrt() + closing);
        }
        let kick = 0.5 * (1e-3 + f64::from(v[middle][3]));
        done.add(kick * power.0, kick * power.1, sure);
        if !sure {
            sound = false;
            continue;
        }
        // Stiffness times area times a metre, of eight points.
        let size = f64::from(solid.stiffness) * 2.0 * DX * DX * (1.0 + firm);
        for (n, sum) in sums.iter().enumerate() {
            let at = n * cells.len() + cell.slot as usize;
            got.extend(now[at][..3].iter().map(|c| f64::from(*c)));
            want.extend((vec3(&was[at]) + sum).iter());
            scale.extend([size; 3]);
        }
        got.push(f64::from(energies[i]));
        want.push(energy);
        scale.push(size);
    }
    let mut facts = vec![
        Compared::close("forces and energies", got, want, scale),
        done.compare(&input.one("clock"), &clock, counts, CASE.tolerance),
    ];
    if cells.len() > 500 {
        facts.push(Compared::fact("some are inside", met > 50));
    }
    if sound {
        let speed = f64::from(f32::from_bits(clock.speed_bits));
        facts.push(Compared::near("speed", vec![speed], vec![fastest], 10.0 + fastest));
    }
    facts
}

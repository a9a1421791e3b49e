//! Proof of `sph/cohesion`: the drive grows by the forces of E = V Σ τ_i/h (2 h² |∇s_i|² − s_i), τ = 0.55 σ, in which walls'
//! part of ∇s counts half, by those of Akinci's cohesion (2013, eq. 2), 0.4 τ h at its peak, and by the walls' pull,
//! whose force times the walls' velocities is power.

use nalgebra::Matrix3;
use physvideo_gpu::kernels::{Body, Counts, Crowd, Local};

use super::{Liquid, Vec3, bend, h, slope, steep, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "sph/cohesion",
    inputs,
    compare,
    tolerance: 3e-6,
    reason: "as the search: distances to 1e-6 h; relative to the sum of the sizes of the terms",
    unordered: &[],
    bytes: 33.0 * 84.0 + 64.0,
    flops: 33.0 * 80.0,
};

/// Three bodies, of which the second has no tension.
fn inputs(ask: Ask) -> Call {
    let mut liquid = Liquid::new(ask);
    let moves = liquid.vectors(|r| [1.0, 2.0, 3.0, f32::from_bits(r.below(3) as u32)]);
    let locals = liquid.locals();
    let bodies = [0.07f32, 0.0, 0.3].map(|tension| Body { p: [tension, 7.0, 7.0, 7.0], ..Default::default() });
    for crowd in &mut liquid.crowds {
        crowd.slope = crowd.slope.map(|c| c / 30.0 * 0.6 / h() as f32);
    }
    liquid.call().with("moves", &moves).with("bodies", &bodies).with("locals", &locals).same("around", "locals")
}

/// Second derivatives of V W at a distance d [1/m²].
fn hessian(d: Vec3) -> Matrix3<f64> {
    let (q, e) = (d.norm() / h(), d.normalize());
    let along = e * e.transpose();
    (along * bend(q) + (Matrix3::identity() - along) * (slope(q) / q)) / (h() * h())
}

/// Akinci's C over a reach of 2 h, 1 where it is largest.
fn cohesion(q: f64) -> f64 {
    let c = |q: f64| if q > 1.0 { (2.0 - q).powi(3) * q.powi(3) } else { 2.0 * (2.0 - q).powi(3) * q.powi(3) - 1.0 };
    if q < 2.0 { c(q) } else { 0.0 }
}

/// What a wall pulls with [τ/h]: the pressure of the attractions on a cubic lattice, Σ F r/(6 h³).
fn wall() -> f64 {
    let around = || -2..=2i32;
    let all = around().flat_map(|x| around().flat_map(move |y| around().map(move |z| x * x + y * y + z * z)));
    let pulls = all.filter(|square| *square > 0).map(|square| f64::from(square).sqrt());
    1.0 + 0.4 / 6.0 * pulls.map(|q| q * cohesion(q)).sum::<f64>()
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let b = &call.buffers;
    let placed = b.one::<Counts>("live").cursor as usize;
    let (places, moves): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (b.get("places"), b.get("moves"));
    let (crowds, bodies): (Vec<Crowd>, Vec<Body>) = (b.get("crowds"), b.get("bodies"));
    let (before, after): (Vec<Local>, Vec<Local>) = (b.get("locals"), out.get("locals"));
    let tension = |i: usize| 0.55 * f64::from(bodies[moves[i][3].to_bits() as usize].p[0]);
    let gradient = |i: usize| vec3(&crowds[i].slope) + vec3(&before[i].wall) / 2.0;
    let (mut got, mut want, mut scale, mut kept) = (Vec::new(), Vec::new(), Vec::new(), true);
    let volume = h().powi(3);
    for i in 0..placed {
        let mass = f64::from(places[i][3]) * volume;
        let mut force = vec3(&before[i].wall) * (volume * tension(i) / h() * wall());
        let mut size = force.norm();
        for j in Liquid::near(call, i) {
            let d = vec3(&places[i]) - vec3(&places[j]);
            let (q, e, both) = (d.norm() / h(), d.normalize(), tension(i) + tension(j));
            let skin = hessian(d) * (gradient(i) * tension(i) - gradient(j) * tension(j)) * (-4.0 * volume * h());
            let pull = e * (both * volume / h() * slope(q) / h() / steep()) - e * (0.2 * both * h() * cohesion(q));
            force += skin + pull;
            size +=
                skin.norm() + pull.norm() + both * h() * 0.2 + 4.0 * volume / h() * (gradient(i) * tension(i)).norm();
        }
        got.extend(after[i].drive.map(f64::from));
        want.extend((vec3(&before[i].drive) + force / mass).iter());
        scale.extend([vec3(&before[i].drive).norm() + size / mass; 3]);
        let pulls = tension(i) / h() * wall() / f64::from(places[i][3]);
        got.push(after[i].power.into());
        want.push(f64::from(before[i].power) + pulls * f64::from(before[i].drift));
        scale.push(f64::from(before[i].power.abs()) + pulls * f64::from(before[i].drift.abs()));
        kept &= Local { drive: before[i].drive, power: before[i].power, ..after[i] } == before[i];
    }
    vec![Compared::close("drive and power", got, want, scale), Compared::fact("all else stays", kept)]
}

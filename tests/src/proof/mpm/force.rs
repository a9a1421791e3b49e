//! Force fields in f64: schedule, region, and the acceleration of each kind.

use physvideo_gpu::kernels::{Body, Field, Forces};

use super::{Vec3, vec3};

/// Closer than this to an end of a schedule [s] or the border of a region [m], rounding decides.
pub const MARGIN: f64 = 1e-4;

/// Fields of every kind, with and without a region and a ramp; they are on around t = 1 s.
pub fn forces() -> Forces {
    let everywhere = Field { kind: 1, start: 0.0, end: 9.0, a: [30.0, -40.0, 20.0, 0.0], ..Default::default() };
    let gust = Field {
        kind: 2,
        region: 1,
        start: 0.9,
        end: 3.0,
        ramp: 0.4,
        p0: 60.0,
        p1: 0.5,
        p2: 1.7,
        a: [3.0, 1.0, -2.0, 0.0],
        region_min: [-0.2, 0.15, 0.0, 0.0],
        region_max: [0.1, 0.6, 0.4, 0.0],
        ..Default::default()
    };
    let poke = Field {
        kind: 3,
        region: 2,
        start: 0.0,
        end: 1.2,
        ramp: 0.5,
        p0: 0.1,
        a: [-800.0, 500.0, 600.0, 0.0],
        b: [-0.1, 0.3, 0.3, 0.0],
        region_min: [-0.1, 0.35, 0.25, 0.0],
        region_max: [0.2, 0.0, 0.0, 0.0],
        ..Default::default()
    };
    let over = Field { kind: 1, start: 0.0, end: 0.5, a: [1e3, 1e3, 1e3, 0.0], ..Default::default() };
    let curl = Field {
        kind: 4,
        end: 9.0,
        p0: 70.0,
        p1: 0.2,
        p2: 0.3,
        a: [0.36, 0.48, 0.8, 0.0],
        b: [-0.05, 0.4, 0.2, 0.0],
        ..Default::default()
    };
    let steady = Field { p0: -30.0, p2: 0.0, b: [0.1, 0.2, 0.3, 0.0], ..curl };
    let drag = Field { kind: 5, end: 9.0, a: [4.0, 11.0, 23.0, 0.0], ..Default::default() };
    let push = Field {
        kind: 6,
        end: 9.0,
        p0: 15.0,
        p1: 90.0,
        p2: 0.2,
        a: [1.0, -0.7, 0.4, 0.11],
        b: [0.3, 77.0, 7.0, 0.0],
        ..Default::default()
    };
    let mut all = Forces { count: 8, ..Default::default() };
    all.d[..8].copy_from_slice(&[everywhere, gust, poke, over, curl, steady, drag, push]);
    all
}

/// Acceleration on material of a body at x moving at v, and whether rounding could decide about it.
pub fn acceleration(forces: &Forces, body: &Body, x: Vec3, v: Vec3, t: f64) -> (Vec3, bool) {
    let (mut sum, mut close) = (vec3(&body.gravity), false);
    for (i, field) in forces.d[..forces.count as usize].iter().enumerate() {
        if body.fields >> i & 1 == 1 {
            let margin = inside(field, x).min(t - f64::from(field.start)).min(f64::from(field.end) - t);
            close |= margin.abs() < MARGIN;
            if margin >= 0.0 {
                sum += ramp(field, t) * kind(field, x, v, t);
            }
        }
    }
    (sum, close)
}

/// Distance inside a field's region, negative outside.
fn inside(field: &Field, x: Vec3) -> f64 {
    let (low, high) = (vec3(&field.region_min), vec3(&field.region_max));
    match field.region {
        1 => (x - low).min().min((high - x).min()),
        2 => high[0] - (x - low).norm(),
        _ => f64::INFINITY,
    }
}

/// Smooth rise at the start and fall at the end: 3s² − 2s³.
fn ramp(field: &Field, t: f64) -> f64 {
    let length = f64::from(field.ramp);
    let rise = |since: f64| {
        let s = if length > 0.0 { (since / length).clamp(0.0, 1.0) } else { 1.0 };
        s * s * (3.0 - 2.0 * s)
    };
    rise(t - f64::from(field.start)) * rise(f64::from(field.end) - t)
}

fn kind(field: &Field, x: Vec3, v: Vec3, t: f64) -> Vec3 {
    let (a, b) = (vec3(&field.a), vec3(&field.b));
    let [p0, p1, p2] = [field.p0, field.p1, field.p2].map(f64::from);
    match field.kind {
        1 => a,
        // Drag p0 towards air at a, which gusts by p1 at p2 Hz.
        2 => p0 * (a * (1.0 + p1 * (std::f64::consts::TAU * p2 * (t - f64::from(field.start))).sin()) - v),
        // A push that falls off as a Gaussian of width p0 around b.
        3 => a * (-(x - b).norm_squared() / (2.0 * p0 * p0)).exp(),
        // c e^(−r/R) sin(ωt) along the tangent, steady without ω.
        4 => {
            let radial = (x - b) - a * a.dot(&(x - b));
            let swing = (std::f64::consts::TAU * p2 * (t - f64::from(field.start))).sin();
            let size = p0 * (-radial.norm() / p1).exp() * if p2 == 0.0 { 1.0 } else { swing };
            size * a.cross(&radial.normalize())
        }
        5 => -a.component_mul(&v),
        6 => {
            let size = (p0 + p1 * (x[2] - p2)).max(0.0);
            let at = [x[0], x[1], x[2], t * f64::from(field.a[3]) / b[0]].map(|c| c / f64::from(field.a[3]));
            size * a.component_mul(&value_noise(at, [field.b[1] as u32, field.b[2] as u32]))
        }
        _ => Vec3::zeros(),
    }
}

/// Noise of variance 1: Σ w u / sqrt(Σ w²) over the 16 corners of the cell, u uniform with variance 1, w products of
/// 3s² − 2s³ and its complement.
fn value_noise(at: [f64; 4], stream: [u32; 2]) -> Vec3 {
    let from = pcg4d([stream[0], stream[1], 0, 0]);
    let (mut sum, mut squares) = (Vec3::zeros(), 0.0);
    for corner in 0..16_i64 {
        let mut weight = 1.0;
        let mut place = [0_u32; 4];
        for axis in 0..4 {
            let (low, up) = (at[axis].floor(), corner >> axis & 1);
            let s = at[axis] - low;
            let rise = s * s * (3.0 - 2.0 * s);
            weight *= if up == 1 { rise } else { 1.0 - rise };
            place[axis] = from[axis].wrapping_add((low as i64 + up) as u32);
        }
        let word = pcg4d(place);
        // A word as a number with a sign is uniform in [−1, 1) · 2³¹, of variance 2⁶²/3.
        let u = |axis: usize| f64::from(word[axis] as i32) / 2f64.powi(31) * 3f64.sqrt();
        sum += weight * Vec3::new(u(0), u(1), u(2));
        squares += weight * weight;
    }
    sum / squares.sqrt()
}

/// PCG4D as its authors give it (Jarzynski & Olano 2020, listing 2).
fn pcg4d(v: [u32; 4]) -> [u32; 4] {
    let mix = |[x, y, z, w]: [u32; 4]| {
        let x = x.wrapping_add(y.wrapping_mul(w));
        let y = y.wrapping_add(z.wrapping_mul(x));
        let z = z.wrapping_add(x.wrapping_mul(y));
        [x, y, z, w.wrapping_add(y.wrapping_mul(z))]
    };
    mix(mix(v.map(|c| c.wrapping_mul(1_664_525).wrapping_add(1_013_904_223))).map(|c| c ^ (c >> 16)))
}

#[cfg(test)]
mod tests {
    use physvideo_gpu::kernels::MEMBERS;

    use super::*;

    #[test]
    fn every_field_is_among_the_forces_and_has_a_twin() {
        let all = forces();
        for member in MEMBERS.iter().filter(|m| m.family == "field") {
            let found = all.d.iter().find(|f| f.kind == member.kind);
            let field = found.unwrap_or_else(|| panic!("{member:?} is not proved"));
            assert!(kind(field, Vec3::new(0.1, 0.2, 0.3), Vec3::x(), 1.0).norm() > 0.0, "{member:?} has no twin here");
        }
    }
}

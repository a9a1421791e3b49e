//! Obstacles in f64: signed distance and normal of each shape, and the law of contact.

use nalgebra::{Rotation3, Unit};
use physvideo_gpu::kernels::Collider;

use super::{Vec3, vec3};

/// Velocity after contact, and how close any decision on the way was to going the other way [m or m/s].
pub fn contact(c: &Collider, x: Vec3, v: Vec3, t: f64) -> (Vec3, f64) {
    let (start, end) = (f64::from(c.start), f64::from(c.end));
    let moved = t.clamp(start, end) - start;
    let (drift, spin) = (vec3(&c.velocity), vec3(&c.spin));
    let turn = Unit::try_new(spin, 0.0)
        .map_or_else(Rotation3::identity, |axis| Rotation3::from_axis_angle(&axis, spin.norm() * moved));
    let r = x - (vec3(&c.center) + drift * moved);
    let (distance, normal, tie) = shape(c.shape, vec3(&c.size), turn.inverse() * r);
    let clear = distance.abs();
    if distance >= 0.0 {
        return (v, clear);
    }
    let n = turn * normal;
    let body = if t >= start && t < end { drift + spin.cross(&r) } else { Vec3::zeros() };
    if c.sticky != 0 {
        return (body, clear);
    }
    let relative = v - body;
    let vn = relative.dot(&n);
    let clear = clear.min(tie).min(vn.abs());
    if vn >= 0.0 {
        return (v, clear);
    }
    // Coulomb: the normal part goes; friction takes at most μ|vn| from the tangential part, never turning it round.
    let vt = relative - n * vn;
    let slip = vt.norm();
    let kept = (slip + f64::from(c.friction) * vn).max(0.0);
    (body + if slip > 0.0 { vt / slip * kept } else { Vec3::zeros() }, clear)
}

/// Signed distance, outward normal, and by how much the choice of the normal was unique.
fn shape(kind: u32, size: Vec3, r: Vec3) -> (f64, Vec3, f64) {
    match kind {
        1 => (r.dot(&size), size, f64::INFINITY),
        2 => (r.norm() - size[0], r.normalize(), r.norm()),
        3 => {
            let q = r.abs() - size;
            let outside = q.map(|c| c.max(0.0));
            if outside.norm() > 0.0 { (outside.norm(), outside, f64::INFINITY) } else { face(q, r, 1.0) }
        }
        // Outside of the room, the deepest wall pushes back in.
        4 => {
            let q = r.abs() - size;
            let (depth, normal, tie) = face(q, r, -1.0);
            (-depth, normal, tie)
        }
        _ => (1.0, Vec3::z(), f64::INFINITY),
    }
}

/// The face of largest q: its q, its normal (towards r times `sign`), and its lead over the next.
fn face(q: Vec3, r: Vec3, sign: f64) -> (f64, Vec3, f64) {
    let axis = q.imax();
    let mut normal = Vec3::zeros();
    normal[axis] = sign * r[axis].signum();
    let next = (0..3).filter(|i| *i != axis).map(|i| q[i]).fold(f64::NEG_INFINITY, f64::max);
    (q[axis], normal, (q[axis] - next).min(r[axis].abs()))
}

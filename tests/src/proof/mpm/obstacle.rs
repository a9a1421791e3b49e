//! Obstacles in f64: signed distance and normal of each shape, and the law of contact.

use nalgebra::{Rotation3, Unit};
use physvideo_gpu::kernels::{Collider, Colliders};

use super::{Vec3, vec3};

/// Velocity of an obstacle at x.
pub fn velocity(c: &Collider, x: Vec3, t: f64) -> Vec3 {
    let (start, end) = (f64::from(c.start), f64::from(c.end));
    let r = x - (vec3(&c.center) + vec3(&c.velocity) * (t.clamp(start, end) - start));
    if t >= start && t < end { vec3(&c.velocity) + vec3(&c.spin).cross(&r) } else { Vec3::zeros() }
}

/// Velocity after contact with what is nearer than `reach`, and how close any decision on the way was to going the
/// other way [m or m/s].
pub fn contact(c: &Collider, x: Vec3, v: Vec3, t: f64, reach: f64) -> (Vec3, f64) {
    let (start, end) = (f64::from(c.start), f64::from(c.end));
    let moved = t.clamp(start, end) - start;
    let (drift, spin, body) = (vec3(&c.velocity), vec3(&c.spin), velocity(c, x, t));
    let turn = Unit::try_new(spin, 0.0)
        .map_or_else(Rotation3::identity, |axis| Rotation3::from_axis_angle(&axis, spin.norm() * moved));
    let r = x - (vec3(&c.center) + drift * moved);
    let (mut v, mut clear) = (v, f64::INFINITY);
    for (distance, normal, tie) in shape(c.shape, vec3(&c.size), turn.inverse() * r) {
        clear = clear.min((distance - reach).abs());
        if distance >= reach {
            continue;
        }
        if c.sticky != 0 {
            return (body, clear);
        }
        let n = turn * normal;
        let relative = v - body;
        let vn = relative.dot(&n);
        clear = clear.min(tie).min(vn.abs());
        if vn >= 0.0 {
            continue;
        }
        // Coulomb: the normal part goes; friction takes at most μ|vn| from the tangential part, never turning it round.
        let vt = relative - n * vn;
        let slip = vt.norm();
        let kept = (slip + f64::from(c.friction) * vn).max(0.0);
        v = body + if slip > 0.0 { vt / slip * kept } else { Vec3::zeros() };
    }
    (v, clear)
}

/// Of each surface that is met for itself: signed distance, outward normal, by how much the choice of it was unique.
pub fn shape(kind: u32, size: Vec3, r: Vec3) -> Vec<(f64, Vec3, f64)> {
    let one = match kind {
        1 => (r.dot(&size), size, f64::INFINITY),
        2 => (r.norm() - size[0], r.normalize(), r.norm()),
        3 => {
            let q = r.abs() - size;
            let outside = q.zip_map(&r, |q, r| q.max(0.0) * r.signum());
            if outside.norm() > 0.0 { (outside.norm(), outside.normalize(), f64::INFINITY) } else { face(q, r) }
        }
        // Each pair of a room's walls pushes back in for itself.
        4 => {
            let wall = |a: usize| (size[a] - r[a].abs(), -r[a].signum() * Vec3::ith(a, 1.0), r[a].abs());
            return (0..3).map(wall).collect();
        }
        _ => (1.0, Vec3::z(), f64::INFINITY),
    };
    vec![one]
}

/// The face of largest q: its q, its normal, and its lead over the next.
fn face(q: Vec3, r: Vec3) -> (f64, Vec3, f64) {
    let axis = q.imax();
    let mut normal = Vec3::zeros();
    normal[axis] = r[axis].signum();
    let next = (0..3).filter(|i| *i != axis).map(|i| q[i]).fold(f64::NEG_INFINITY, f64::max);
    (q[axis], normal, (q[axis] - next).min(r[axis].abs()))
}

/// One of each shape: sticking, separating, rubbing, at rest, moving, spinning, not yet and no longer moving.
pub fn obstacles() -> Colliders {
    let still = Collider { end: 1e9, ..Default::default() };
    let tilted = Vec3::new(0.2, -0.1, 1.0).normalize();
    let plane = Collider {
        shape: 1,
        friction: 0.4,
        center: [0.0, 0.0, 0.181, 0.0],
        size: [tilted[0] as f32, tilted[1] as f32, tilted[2] as f32, 0.0],
        ..still
    };
    let spinning_box = Collider {
        shape: 3,
        friction: 0.2,
        start: 0.1,
        end: 2.0,
        center: [-0.1, 0.3, 0.3, 0.0],
        size: [0.12, 0.07, 0.05, 0.0],
        velocity: [0.1, -0.05, 0.02, 0.0],
        spin: [1.0, -2.0, 3.0, 0.0],
        ..still
    };
    let sticky_ball = Collider {
        shape: 2,
        sticky: 1,
        start: 0.0,
        end: 3.0,
        center: [0.1, 0.45, 0.35, 0.0],
        size: [0.09, 0.0, 0.0, 0.0],
        velocity: [-0.1, 0.0, 0.05, 0.0],
        spin: [0.0, 0.0, 4.0, 0.0],
        ..still
    };
    let parked = Collider { shape: 2, friction: 9.0, start: 0.0, end: 0.4, spin: [5.0, 1.0, 0.0, 0.0], ..sticky_ball };
    let parked = Collider { sticky: 0, center: [-0.2, 0.2, 0.2, 0.0], size: [0.07, 0.0, 0.0, 0.0], ..parked };
    let waiting = Collider { shape: 3, start: 2.0, end: 3.0, center: [0.3, 0.6, 0.4, 0.0], ..spinning_box };
    let room = Collider {
        shape: 4,
        friction: 0.1,
        center: [0.05, 0.4, 0.25, 0.0],
        size: [0.331, 0.2703, 0.1901, 0.0],
        spin: [0.0, 0.0, 0.1, 0.0],
        ..still
    };
    let nothing = Collider { shape: 7, sticky: 1, ..still };
    let mut all = Colliders { count: 7, ..Default::default() };
    all.d[..7].copy_from_slice(&[plane, spinning_box, sticky_ball, parked, waiting, room, nothing]);
    all
}

#[cfg(test)]
mod tests {
    use physvideo_gpu::kernels::MEMBERS;

    use super::*;

    #[test]
    fn every_shape_is_among_the_obstacles() {
        let all = obstacles();
        for shape in MEMBERS.iter().filter(|m| m.family == "shape") {
            assert!(all.d.iter().any(|c| c.shape == shape.kind), "{shape:?}");
        }
    }
}

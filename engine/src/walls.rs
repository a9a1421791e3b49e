//! Where obstacles are, and which of them a liquid can meet: a room is solid all around, so what lies behind its walls is not
//! met. Knows obstacles and no solver.

use glam::{Quat, Vec3};
use physvideo_gpu::kernels::Collider;
use physvideo_gpu::kernels::family::shape::{BALL, BOX, PLANE, ROOM};

/// Whether an obstacle ever moves.
pub fn moves(c: &Collider) -> bool {
    (c.velocity, c.spin) != ([0.0; 4], [0.0; 4])
}

/// How wide an obstacle is where it is least [m]; absent for what has no end behind its surface.
pub(crate) fn width(c: &Collider) -> Option<f32> {
    match c.shape {
        BALL => Some(2.0 * c.size[0]),
        BOX => Some(2.0 * c.size[0].min(c.size[1]).min(c.size[2])),
        _ => None,
    }
}

/// Distance of a place from an obstacle's surface at its start, below 0 inside [m].
pub(crate) fn distance(c: &Collider, x: [f32; 3]) -> f32 {
    let from: [f32; 3] = std::array::from_fn(|a| x[a] - c.center[a]);
    let [p, q, r]: [f32; 3] = std::array::from_fn(|a| from[a].abs() - c.size[a]);
    match c.shape {
        PLANE => from.iter().zip(c.size).map(|(d, n)| d * n).sum(),
        BALL => from.iter().map(|d| d * d).sum::<f32>().sqrt() - c.size[0],
        BOX => [p, q, r].map(|d| d.max(0.0).powi(2)).iter().sum::<f32>().sqrt() + p.max(q).max(r).min(0.0),
        _ => -p.max(q).max(r),
    }
}

/// The same of an obstacle as it has moved by `time` [s].
pub(crate) fn distance_at(c: &Collider, x: [f32; 3], time: f64) -> f32 {
    let moved = time.clamp(c.start.into(), c.end.into()) as f32 - c.start;
    let spin = Vec3::new(c.spin[0], c.spin[1], c.spin[2]);
    let center = Vec3::new(c.center[0], c.center[1], c.center[2]);
    let from = Vec3::from(x) - center - moved * Vec3::new(c.velocity[0], c.velocity[1], c.velocity[2]);
    distance(c, (center + Quat::from_scaled_axis(-moved * spin) * from).to_array())
}

/// The `colliders` without those that lie behind the walls of a room, each still, to within `tolerance` [m]. Surfaces that
/// coincide count once (see `lib/wall` of the kernels), each for its share: a ground in the plane of a room's floor would
/// lend it half of its friction, and every particle on it would look at both.
pub(crate) fn met(colliders: &[Collider], tolerance: f32) -> Vec<Collider> {
    let mut left = colliders.to_vec();
    // One at a time, so that of two equal rooms one is left.
    while let Some(k) = (0..left.len())
        .rev()
        .find(|k| left.iter().enumerate().any(|(j, room)| j != *k && lies_behind(&left[*k], room, tolerance)))
    {
        left.remove(k);
    }
    left
}

/// Whether `c` leaves the inside of the room `r` free.
fn lies_behind(c: &Collider, r: &Collider, tolerance: f32) -> bool {
    if r.shape != ROOM || moves(r) || moves(c) {
        return false;
    }
    let apart: [f32; 3] = std::array::from_fn(|a| (c.center[a] - r.center[a]).abs());
    match c.shape {
        PLANE => {
            let across = (0..3).map(|a| (r.center[a] - c.center[a]) * c.size[a]).sum::<f32>();
            let reach = (0..3).map(|a| (r.size[a] * c.size[a]).abs()).sum::<f32>();
            across - reach >= -tolerance
        }
        BOX => (0..3).any(|a| apart[a] - c.size[a] - r.size[a] >= -tolerance),
        BALL => {
            let out = (0..3).map(|a| (apart[a] - r.size[a]).max(0.0).powi(2)).sum::<f32>().sqrt();
            out >= c.size[0] - tolerance && out > 0.0
        }
        ROOM => (0..3).all(|a| apart[a] + r.size[a] <= c.size[a] + tolerance),
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(shape: u32, center: [f32; 3], size: [f32; 3]) -> Collider {
        let [x, y, z] = center;
        Collider {
            shape,
            center: [x, y, z, 0.0],
            size: [size[0], size[1], size[2], 0.0],
            end: 1e9,
            ..Default::default()
        }
    }

    fn left(more: Collider) -> usize {
        let room = of(ROOM, [0.0, 0.0, 0.5], [0.2, 0.2, 0.5]);
        assert_eq!(met(&[more, room], 1e-4).len(), met(&[room, more], 1e-4).len());
        met(&[more, room], 1e-4).len()
    }

    #[test]
    fn what_is_behind_a_rooms_walls_is_not_met() {
        assert_eq!(left(of(PLANE, [0.0; 3], [0.0, 0.0, 1.0])), 1, "the ground in the plane of its floor");
        assert_eq!(left(of(PLANE, [0.0, 0.0, -0.3], [0.0, 0.0, 1.0])), 1, "a ground below it");
        assert_eq!(left(of(BOX, [0.3, 0.0, 0.5], [0.1, 0.1, 0.1])), 1, "a box beside it");
        assert_eq!(left(of(BALL, [0.0, 0.0, -0.1], [0.1, 0.0, 0.0])), 1, "a ball below it");
        assert_eq!(left(of(ROOM, [0.0, 0.0, 0.5], [0.2, 0.2, 0.5])), 1, "the same room again");
        assert_eq!(left(of(ROOM, [0.0, 0.0, 0.5], [0.3, 0.3, 0.6])), 1, "a room around it");
    }

    #[test]
    fn what_reaches_into_it_is_met() {
        assert_eq!(left(of(PLANE, [0.0, 0.0, 0.01], [0.0, 0.0, 1.0])), 2, "a ground above its floor");
        assert_eq!(left(of(PLANE, [0.0; 3], [0.6, 0.0, 0.8])), 2, "a slope through it");
        assert_eq!(left(of(BOX, [0.29, 0.0, 0.5], [0.1, 0.1, 0.1])), 2, "a box through its wall");
        assert_eq!(left(of(BALL, [0.0, 0.0, 0.3], [0.1, 0.0, 0.0])), 2, "a ball in it");
        assert_eq!(left(of(ROOM, [0.1, 0.0, 0.5], [0.2, 0.2, 0.5])), 2, "a room that crosses it");
        let moving = Collider { velocity: [0.0, 0.0, 1.0, 0.0], ..of(PLANE, [0.0; 3], [0.0, 0.0, 1.0]) };
        assert_eq!(left(moving), 2, "a floor that rises");
    }
}

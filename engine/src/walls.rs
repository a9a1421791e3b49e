//! Which obstacles a liquid can meet: a room is solid all around, so what lies behind its walls is not met, and a surface
//! that coincides with one of them is not met twice. Knows obstacles and no solver.

use physvideo_gpu::kernels::Collider;
use physvideo_gpu::kernels::family::shape::{BALL, BOX, PLANE, ROOM};

/// Whether an obstacle ever moves.
pub fn moves(c: &Collider) -> bool {
    (c.velocity, c.spin) != ([0.0; 4], [0.0; 4])
}

/// The `colliders` without those that lie behind the walls of a room, each still, to within `tolerance` [m]. A surface of SPH
/// stands for fluid behind it (see `lib/wall` of the kernels): a ground in the plane of a room's floor would stand for it a
/// second time, and push off what lies on it.
pub(crate) fn met(colliders: &[Collider], tolerance: f32) -> Vec<Collider> {
    let mut left: Vec<Collider> = colliders.to_vec();
    // One at a time, so that of two equal rooms one is left.
    while let Some(i) = (0..left.len()).rev().find(|i| {
        let behind = |j: usize| j != *i && lies_behind(&left[*i], &left[j], tolerance);
        (0..left.len()).any(behind)
    }) {
        left.remove(i);
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

//! Which obstacles a liquid can meet: a room is solid all around, so what lies behind its walls is not met, and a surface
//! that coincides with one of them is not met twice. Knows obstacles and no solver.

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

/// The `colliders` without those that lie behind the walls of a room, each still, to within `tolerance` [m]. A surface of SPH
/// stands for fluid behind it (see `lib/wall` of the kernels): a ground in the plane of a room's floor would stand for it a
/// second time, and push off what lies on it.
pub(crate) fn met(colliders: &[Collider], tolerance: f32) -> Vec<Collider> {
    sift(colliders, tolerance).0
}

/// Those that are left, and their numbers.
fn sift(colliders: &[Collider], tolerance: f32) -> (Vec<Collider>, Vec<usize>) {
    let mut left: Vec<usize> = (0..colliders.len()).collect();
    // One at a time, so that of two equal rooms one is left.
    while let Some(k) = (0..left.len()).rev().find(|k| {
        let behind = |j: &usize| *j != left[*k] && lies_behind(&colliders[left[*k]], &colliders[*j], tolerance);
        left.iter().any(behind)
    }) {
        left.remove(k);
    }
    (left.iter().map(|i| colliders[*i]).collect(), left)
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

/// Two obstacles, by their numbers, that a liquid meets with faces in one plane at the start, to within `reach` [m]: what lies
/// before both is pushed by both. Of faces across an axis only.
pub(crate) fn coincide(colliders: &[Collider], reach: f32) -> Option<(usize, usize)> {
    let (_, left) = sift(colliders, 1e-2 * reach);
    let pairs = left.iter().enumerate().flat_map(|(k, i)| left[k + 1..].iter().map(|j| (*i, *j)));
    let shared = |(i, j): &(usize, usize)| {
        let others = faces(&colliders[*j]);
        faces(&colliders[*i]).iter().any(|f| others.iter().any(|g| f.shares(g, reach)))
    };
    pairs.into_iter().find(shared)
}

/// A face across an axis.
struct Face {
    axis: usize,
    /// Its normal points up the axis.
    up: bool,
    at: f32,
    /// Its rectangle; along its own axis it means nothing.
    low: [f32; 3],
    high: [f32; 3],
}

impl Face {
    fn shares(&self, other: &Face, reach: f32) -> bool {
        let laps = |a: usize| self.high[a].min(other.high[a]) - self.low[a].max(other.low[a]) > reach;
        (self.axis, self.up) == (other.axis, other.up)
            && (self.at - other.at).abs() < reach
            && (0..3).all(|a| a == self.axis || laps(a))
    }
}

fn faces(c: &Collider) -> Vec<Face> {
    let center = [c.center[0], c.center[1], c.center[2]];
    match c.shape {
        // Normals of a room point inwards, those of a box outwards.
        BOX | ROOM if c.spin == [0.0; 4] => {
            let side = |(axis, high): (usize, bool)| Face {
                axis,
                up: high == (c.shape == BOX),
                at: center[axis] + if high { c.size[axis] } else { -c.size[axis] },
                low: std::array::from_fn(|a| center[a] - c.size[a]),
                high: std::array::from_fn(|a| center[a] + c.size[a]),
            };
            (0..3).flat_map(|axis| [(axis, false), (axis, true)]).map(side).collect()
        }
        PLANE => {
            let along = |axis: &usize| (0..3).all(|a| a == *axis || c.size[a] == 0.0);
            let plane = |axis: usize| Face {
                axis,
                up: c.size[axis] > 0.0,
                at: center[axis],
                low: [f32::MIN; 3],
                high: [f32::MAX; 3],
            };
            (0..3).find(along).map(plane).into_iter().collect()
        }
        _ => Vec::new(),
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

    #[test]
    fn faces_in_one_plane_are_seen() {
        let room = of(ROOM, [0.0, 0.0, 0.5], [0.2, 0.2, 0.5]);
        let piston = |x: f32| Collider { velocity: [1.0; 4], ..of(BOX, [x, 0.0, 0.5], [0.1, 0.2, 0.5]) };
        let ground = of(PLANE, [0.0; 3], [0.0, 0.0, 1.0]);
        assert_eq!(coincide(&[room, piston(-0.3)], 0.01), Some((0, 1)), "its front in the plane of the wall");
        assert_eq!(coincide(&[room, piston(-0.25)], 0.01), None, "its front before the wall");
        assert_eq!(coincide(&[ground, room], 0.01), None, "the ground is behind the floor and not met");
        let slab = of(BOX, [0.0, 0.0, -0.1], [0.3, 0.3, 0.1]);
        assert_eq!(coincide(&[slab, ground], 0.01), Some((0, 1)), "a slab let into the ground");
        assert_eq!(coincide(&[slab, of(BOX, [0.6, 0.0, -0.1], [0.3, 0.3, 0.1])], 0.01), None, "slabs side by side");
        assert_eq!(coincide(&[of(BOX, [0.0, 0.0, 0.1], [0.1, 0.1, 0.1]), ground], 0.01), None, "a box on the ground");
    }
}

//! What holds a body on its own grid. Behind a clamped face a node moves by the opposite of its mirror image, which
//! makes the displacement zero on the face itself; other nodes at held particles do not move. Knows places only.

use std::collections::HashMap;

use super::lattice::{At, around, moved};

/// What a node does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    /// Moves.
    Free,
    /// Does not move.
    Fixed,
    /// Moves by the opposite of the node at this place.
    Mirror(At),
}

/// Which particles a cell has, a bit a corner.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Points {
    /// Those that move.
    pub free: u8,
    /// Those that are held.
    pub held: u8,
}

/// On which side of a clamped face a place is; beyond the reach of every particle it is on none.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Before,
    On,
    Behind,
    Nowhere,
}

/// The cell's own particles decide; where there are none, those of its nearest neighbours.
fn side(cells: &HashMap<At, Points>, at: At) -> Side {
    for distance in 0..4 {
        let near = around().filter(|s| s.iter().map(|c| c * c).sum::<i32>() == distance);
        let all = near
            .filter_map(|s| cells.get(&moved(at, s)))
            .fold(Points::default(), |sum, p| Points { free: sum.free | p.free, held: sum.held | p.held });
        match (all.free > 0, all.held > 0) {
            (false, false) => {}
            (true, false) => return Side::Before,
            (false, true) => return Side::Behind,
            (true, true) => return Side::On,
        }
    }
    Side::Nowhere
}

/// The role of a node. A face between cells has its mirror image one node on, a face through a cell's middle two; with
/// none along the axes, or several, the node is at an edge and does not move.
pub(super) fn role(cells: &HashMap<At, Points>, at: At) -> Role {
    match side(cells, at) {
        Side::Before | Side::Nowhere => return Role::Free,
        Side::On => return Role::Fixed,
        Side::Behind => {}
    }
    let mut images = around().filter(|s| s.iter().map(|c| c * c).sum::<i32>() == 1).filter_map(|s| {
        let (one, two) = (moved(at, s), moved(at, s.map(|c| 2 * c)));
        match side(cells, one) {
            Side::Before => Some(one),
            Side::On if side(cells, two) == Side::Before => Some(two),
            _ => None,
        }
    });
    match (images.next(), images.next()) {
        (Some(image), None) => Role::Mirror(image),
        _ => Role::Fixed,
    }
}

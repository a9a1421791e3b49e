//! What holds a body: the particles in its pins, and pieces of it that would hover.

use std::collections::HashMap;

use glam::Vec3;

use crate::assemble::View;
use crate::geometry;
use crate::scene::{Kind, Problem, Region, Scene, Source};

/// Holds every particle inside a region.
pub fn pin(
    scene: &Scene,
    region: &Region,
    view: Option<&View>,
    positions: &[[f32; 3]],
    pinned: &mut [bool],
) -> Result<(), Problem> {
    let wrong = |message: String| Problem::new(Kind::Conflict, "object", message);
    let mut hold = |inside: &dyn Fn(Vec3) -> bool| {
        for (flag, x) in pinned.iter_mut().zip(positions) {
            *flag |= inside(Vec3::from(*x));
        }
    };
    match region {
        Region::Box { min, max } => {
            hold(&|x| x.cmpge(Vec3::from(*min)).all() && x.cmple(Vec3::from(*max)).all());
        }
        Region::Ball { center, radius } => hold(&|x| x.distance(Vec3::from(*center)) <= *radius),
        Region::Pixels { min, max } => {
            let Some(v) = view else { return Err(wrong("a pin of `pixels` needs [photo]".into())) };
            // The rectangle is given at the photograph's full size; the principal point tells the scale.
            let scale = scene.photo.as_ref().map_or(1.0, |p| v.photo.focal_px / p.focal_px);
            let camera = v.photo.camera();
            hold(&|x| {
                camera
                    .project(v.world.to_camera(x))
                    .is_some_and(|(p, _)| (0..2).all(|a| p[a] >= min[a] * scale && p[a] <= max[a] * scale))
            });
        }
        Region::Near { object, distance } => {
            let label = scene
                .objects
                .iter()
                .find(|o| &o.name == object)
                .and_then(|o| if let Source::Mask { label, .. } = o.source { Some(label) } else { None });
            let (Some(label), Some(View { photo, surfaces: Some(map), world, .. })) = (label, view) else {
                return Err(wrong(format!("a pin `near` needs '{object}' to be a mask of the photograph")));
            };
            let point = geometry::surface_point(map, world);
            let points = geometry::display_points(map, label, &photo.rgb, point).map_err(|e| wrong(e.to_string()))?;
            let near: Vec<Vec3> = points.positions.iter().map(|p| Vec3::from(*p)).collect();
            hold(&|x| near.iter().any(|p| p.distance_squared(x) <= distance * distance));
        }
    }
    Ok(())
}

/// A connected piece of a body.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Loose {
    /// Pieces that no pin reaches.
    pub pieces: usize,
    /// Their particles.
    pub particles: usize,
}

/// Holds the pieces of a body that no pin reaches: starting at rest under gravity they would hover, and drift off in
/// the first breeze. They come from photographs, where one part hides what holds another. Particles are of one piece
/// when their cells of size `reach` touch.
pub fn hold_loose(positions: &[[f32; 3]], reach: f32, pinned: &mut [bool]) -> Loose {
    let mut cells: HashMap<[i32; 3], Vec<usize>> = HashMap::new();
    for (i, x) in positions.iter().enumerate() {
        cells.entry(x.map(|c| (c / reach).floor() as i32)).or_default().push(i);
    }
    let mut loose = Loose::default();
    let starts: Vec<_> = cells.keys().copied().collect();
    for start in starts {
        let (mut piece, mut front) = (Vec::new(), vec![start]);
        while let Some(at) = front.pop() {
            if let Some(members) = cells.remove(&at) {
                piece.extend(members);
                // Far-away particles share the last cell there is; beyond it is none.
                let steps = (0..27).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
                front.extend(steps.map(|s| std::array::from_fn(|a| at[a].saturating_add(s[a]))));
            }
        }
        if !piece.is_empty() && !piece.iter().any(|i| pinned[*i]) {
            loose.pieces += 1;
            loose.particles += piece.len();
            piece.iter().for_each(|i| pinned[*i] = true);
        }
    }
    loose
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two bars a gap apart; the first is pinned at its end.
    #[test]
    fn a_piece_that_no_pin_reaches_is_held_and_the_rest_is_not() {
        let bar = |x0: f32| (0..20).map(move |i| [x0 + 0.01 * i as f32, 0.0, 0.0]);
        let positions: Vec<_> = bar(0.0).chain(bar(0.5)).collect();
        let mut pinned: Vec<bool> = positions.iter().map(|x| x[0] < 0.02).collect();
        assert_eq!(hold_loose(&positions, 0.02, &mut pinned), Loose { pieces: 1, particles: 20 });
        assert!(pinned.iter().zip(&positions).all(|(p, x)| *p == (x[0] < 0.02 || x[0] > 0.4)));
        // Control: bars that touch are one piece, and nothing more is held.
        let positions: Vec<_> = bar(0.0).chain(bar(0.2)).collect();
        let mut pinned: Vec<bool> = positions.iter().map(|x| x[0] < 0.02).collect();
        let before = pinned.clone();
        assert_eq!(hold_loose(&positions, 0.02, &mut pinned), Loose::default());
        assert_eq!(pinned, before);
    }

    /// Coordinates no cell can number are no reason to stop: who refuses them comes later.
    #[test]
    fn particles_out_of_all_bounds_are_one_piece() {
        let positions = [[3e38, -3e38, 0.0], [1e30, -1e30, 0.0], [0.0; 3]];
        let mut pinned = vec![false, false, true];
        assert_eq!(hold_loose(&positions, 1e-3, &mut pinned), Loose { pieces: 1, particles: 2 });
    }
}

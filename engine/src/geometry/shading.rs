//! Looks of bodies that bring no colours: a pattern of checks and the light they stand in at the start. Must not
//! know how they are drawn.

use std::collections::HashSet;

use glam::Vec3;

use super::volume::Particles;

/// Brightness of the darker checks, of sRGB values.
const DARK: f32 = 0.72;
/// What lies on an edge of checks belongs to those above it, whatever rounding says [sides].
const EDGE: f32 = 1e-4;
/// Brightness of what faces away from the light, of sRGB values.
const AWAY: f32 = 0.45;
/// Reach of the search for a surface's direction [lattice spacings].
const REACH: i32 = 3;

/// Darkens every other cube of side `side` [m]; `local` takes a position to the body's own axes.
pub fn checks(particles: &mut Particles, side: f32, local: impl Fn(Vec3) -> Vec3) {
    for (x, color) in particles.positions.iter().zip(&mut particles.colors) {
        let cell = (local(Vec3::from(*x)) / side + EDGE).floor();
        if (cell.x + cell.y + cell.z).rem_euclid(2.0) >= 1.0 {
            *color = color.map(|c| c * DARK);
        }
    }
}

/// Shades the surface of a body that fills a lattice of `spacing` [m] by a light in direction `light`. The shade is
/// the surface's: it turns and moves with it.
pub fn shade(particles: &mut Particles, spacing: f32, light: Vec3) {
    let Some(light) = light.try_normalize() else { return };
    // From the first particle: a lattice of a body's own may lie half way between places of another.
    let first = particles.positions.first().copied().unwrap_or_default();
    let place = |x: &[f32; 3]| -> [i32; 3] { std::array::from_fn(|a| ((x[a] - first[a]) / spacing).round() as i32) };
    let filled: HashSet<[i32; 3]> = particles.positions.iter().map(place).collect();
    for (x, color) in particles.positions.iter().zip(&mut particles.colors) {
        let at = place(x);
        if let Some(normal) = outwards(&filled, at) {
            // Wrapped Lambert: sides that the light misses keep their shape.
            let lit = 0.5 + 0.5 * normal.dot(light);
            *color = color.map(|c| c * (AWAY + (1.0 - AWAY) * lit));
        }
    }
}

/// Direction out of the body at a place of the lattice; none inside and where it is as thin on both sides.
fn outwards(filled: &HashSet<[i32; 3]>, at: [i32; 3]) -> Option<Vec3> {
    let there = |d: [i32; 3]| filled.contains(&[at[0] + d[0], at[1] + d[1], at[2] + d[2]]);
    let sides = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]];
    if sides.into_iter().all(there) {
        return None;
    }
    let mut sum = Vec3::ZERO;
    for z in -REACH..=REACH {
        for y in -REACH..=REACH {
            for x in -REACH..=REACH {
                let d = Vec3::new(x as f32, y as f32, z as f32);
                if d.length_squared() <= (REACH * REACH) as f32 && !there([x, y, z]) {
                    sum += d;
                }
            }
        }
    }
    // Whole numbers are summed, so that a balance is exactly zero.
    sum.try_normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(n: [i32; 3]) -> Particles {
        let mut positions = Vec::new();
        for z in 0..n[2] {
            for y in 0..n[1] {
                for x in 0..n[0] {
                    positions.push([x as f32 + 0.5, y as f32 + 0.5, z as f32 + 0.5]);
                }
            }
        }
        let colors = vec![[1.0; 3]; positions.len()];
        Particles { positions, volume: 1.0, colors }
    }

    fn color_at(p: &Particles, x: [f32; 3]) -> f32 {
        p.colors[p.positions.iter().position(|q| *q == x).unwrap()][0]
    }

    #[test]
    fn what_faces_the_light_is_bright_and_what_faces_away_is_dark() {
        let mut body = block([9, 9, 9]);
        shade(&mut body, 1.0, Vec3::new(0.0, 0.0, 2.0));
        assert!((color_at(&body, [4.5, 4.5, 8.5]) - 1.0).abs() < 1e-6);
        assert!((color_at(&body, [4.5, 4.5, 0.5]) - AWAY).abs() < 1e-6);
        let side = color_at(&body, [0.5, 4.5, 4.5]);
        assert!((side - 0.5 * (1.0 + AWAY)).abs() < 1e-6, "{side}");
        assert_eq!(color_at(&body, [4.5, 4.5, 4.5]), 1.0, "inside nothing is shaded");
    }

    #[test]
    fn a_sheet_of_one_layer_keeps_its_colour() {
        let mut sheet = block([9, 9, 1]);
        shade(&mut sheet, 1.0, Vec3::Z);
        assert_eq!(color_at(&sheet, [4.5, 4.5, 0.5]), 1.0);
    }

    #[test]
    fn checks_alternate_in_the_bodys_own_axes() {
        let mut row = block([8, 1, 1]);
        checks(&mut row, 2.0, |x| x - Vec3::new(1.0, 0.0, 0.0));
        let dark: Vec<bool> = row.colors.iter().map(|c| c[0] < 1.0).collect();
        assert_eq!(dark, [true, false, false, true, true, false, false, true]);
    }
}

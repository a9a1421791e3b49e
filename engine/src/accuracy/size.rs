//! How thick a body is. Sees nothing but its particles.

/// Size of a body [m] that a quarter of it does not reach: for each particle the shortest of the three runs of
/// neighbours through it along the axes. For a bar that is its thickness, for a ball about half of its diameter. Particles
/// are `spacing` [m] apart, or are counted in cubes of it.
pub fn size(positions: &[[f32; 3]], spacing: f32) -> f32 {
    // The first layer is in the middle of its cubes, wherever the body's lattice lies.
    let low: [f32; 3] = std::array::from_fn(|a| positions.iter().map(|x| x[a]).fold(f32::MAX, f32::min));
    let place = |x: &[f32; 3]| -> [i64; 3] {
        std::array::from_fn(|a| (f64::from(x[a] - low[a]) / f64::from(spacing) + 0.5).floor() as i64)
    };
    let mut cubes: Vec<[i64; 3]> = positions.iter().map(place).collect();
    cubes.sort_unstable();
    cubes.dedup();
    let mut shortest = vec![u32::MAX; cubes.len()];
    for axis in 0..3 {
        // Lines along the axis one after the other.
        let key = |i: &usize| {
            let c = cubes[*i];
            (c[(axis + 1) % 3], c[(axis + 2) % 3], c[axis])
        };
        let mut order: Vec<usize> = (0..cubes.len()).collect();
        order.sort_unstable_by_key(key);
        let follows = |a: &usize, b: &usize| {
            let (a, b) = (key(a), key(b));
            (a.0, a.1, a.2 + 1) == b
        };
        for run in order.chunk_by(follows) {
            for i in run {
                shortest[*i] = shortest[*i].min(run.len() as u32);
            }
        }
    }
    shortest.sort_unstable();
    shortest.get(shortest.len() / 4).map_or(0.0, |n| *n as f32 * spacing)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(n: [i32; 3], keep: impl Fn([f32; 3]) -> bool) -> Vec<[f32; 3]> {
        let all = (0..n[0] * n[1] * n[2]).map(|i| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])]);
        all.map(|i| i.map(|c| (c as f32 + 0.5) * 0.1)).filter(|x| keep(*x)).collect()
    }

    #[test]
    fn a_bar_is_as_thick_as_its_thinnest_side() {
        assert!((size(&body([40, 6, 9], |_| true), 0.1) - 0.6).abs() < 1e-6);
        assert!((size(&body([3, 30, 30], |_| true), 0.1) - 0.3).abs() < 1e-6);
    }

    #[test]
    fn a_plate_on_a_block_counts_where_it_is_a_quarter() {
        let on_block = |wide: f32| body([60, 20, 20], |x| x[0] < 2.0 || (x[0] < wide && x[2] < 0.4));
        // 8000 in the block, 80 a layer of the plate.
        assert!((size(&on_block(6.0), 0.1) - 0.4).abs() < 1e-6);
        assert!(size(&on_block(2.5), 0.1) > 1.9);
    }

    #[test]
    fn a_ball_is_half_of_its_diameter() {
        let ball = body([20, 20, 20], |x| x.iter().map(|c| (c - 1.0).powi(2)).sum::<f32>() < 1.0);
        assert!((0.8..1.3).contains(&size(&ball, 0.1)), "{}", size(&ball, 0.1));
    }

    #[test]
    fn no_particles_have_no_size() {
        assert!(size(&[], 0.1).abs() < 1e-9);
    }

    /// On the edges of cubes counted from the origin, where rounding would decide.
    #[test]
    fn where_a_lattice_lies_does_not_matter() {
        let spacing = 0.013;
        let at = |i: i32| [i % 7, i / 7 % 7, i / 49].map(|k| (k - 3) as f32 * spacing);
        let cube: Vec<[f32; 3]> = (0..343).map(at).collect();
        assert!((size(&cube, spacing) - 7.0 * spacing).abs() < 1e-6, "{}", size(&cube, spacing));
    }
}

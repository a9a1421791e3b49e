//! How much of a full grid a body leaves to others: its volume, smoothed as a grid's matter is that its particles give by
//! the B-spline and a place takes by it again. Opens no device.

use super::lattice::At;

/// Reach of a particle, in places of the lattice, half a cell each.
const REACH: i32 = 5;
/// Places that a field may have; a body whose box has more leaves as much as one with flat faces does.
const MOST: usize = 1 << 26;

/// The share of each place that the body fills.
pub(super) struct Fill {
    size: [usize; 3],
    /// x fastest; empty where there are too many.
    field: Vec<f32>,
}

impl Fill {
    /// Of particles at `places`, the lowest of which along each axis is 0. The B-spline of degree 5 is the quadratic one
    /// with itself, in the mean over where the grid lies; each axis by itself.
    pub fn new(places: &[At]) -> Self {
        let size: [usize; 3] = std::array::from_fn(|a| {
            let highest = places.iter().map(|p| p[a]).max().unwrap_or(0);
            (highest + 2 * REACH + 1).max(1) as usize
        });
        let count = size.iter().try_fold(1usize, |all, n| all.checked_mul(*n)).filter(|n| *n <= MOST);
        let Some(count) = count else { return Self { size, field: Vec::new() } };
        let mut field = vec![0.0f32; count];
        let step = [1, size[0], size[0] * size[1]];
        for p in places {
            field[(0..3).map(|a| (p[a] + REACH) as usize * step[a]).sum::<usize>()] = 1.0;
        }
        // Half a cell's worth of each place.
        let weights: Vec<f32> = (0..=REACH).map(|d| 0.5 * quintic(0.5 * d as f32)).collect();
        for axis in 0..3 {
            let was = field.clone();
            for (i, to) in field.iter_mut().enumerate() {
                let at = i / step[axis] % size[axis];
                let mut sum = weights[0] * was[i];
                for (d, w) in weights.iter().enumerate().skip(1) {
                    if at >= d {
                        sum += w * was[i - d * step[axis]];
                    }
                    if at + d < size[axis] {
                        sum += w * was[i + d * step[axis]];
                    }
                }
                *to = sum;
            }
        }
        Self { size, field }
    }

    /// What is left at the face of the particle at `at` along `axis`, above or below it.
    pub fn room(&self, at: At, axis: usize, up: bool) -> f32 {
        let value = |at: At| {
            let index = ((at[2] + REACH) as usize * self.size[1] + (at[1] + REACH) as usize) * self.size[0];
            self.field.get(index + (at[0] + REACH) as usize).copied()
        };
        let mut over = at;
        over[axis] += if up { 1 } else { -1 };
        // A face lies in the middle between two places.
        match (value(at), value(over)) {
            (Some(a), Some(b)) => 1.0 - 0.5 * (a + b),
            _ => 0.5,
        }
    }
}

/// The B-spline of degree 5 (its value at 0 is 0.55), as a sum of truncated powers.
fn quintic(x: f32) -> f32 {
    let power = |from: f32| (from - x.abs()).max(0.0).powi(5);
    (power(3.0) - 6.0 * power(2.0) + 15.0 * power(1.0)) / 120.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One half at a flat face, a quarter of the body at an edge, little of a sheet.
    #[test]
    fn a_body_leaves_half_at_its_faces() {
        let block = |n: [i32; 3]| -> Vec<At> {
            (0..n[0] * n[1] * n[2]).map(|i| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])]).collect()
        };
        let cube = Fill::new(&block([16; 3]));
        assert!((cube.room([8, 8, 15], 2, true) - 0.5).abs() < 0.01, "{}", cube.room([8, 8, 15], 2, true));
        assert!((cube.room([0, 8, 8], 0, false) - 0.5).abs() < 0.01);
        let edge = cube.room([15, 8, 15], 2, true);
        assert!((0.6..0.75).contains(&edge), "{edge}");
        let sheet = Fill::new(&block([16, 16, 1]));
        assert!((0.7..0.8).contains(&sheet.room([8, 8, 0], 2, true)), "{}", sheet.room([8, 8, 0], 2, true));
        // Control: half a cell outside there is more room than at the face.
        assert!(cube.room([8, 8, 16], 2, true) > 0.7);
    }
}

//! Quadratic B-spline by its definition (Steffen 2008, eq. 23), as a function of the distance in cells.

use physvideo_gpu::kernels::Grid;

use super::{Vec3, vec3};

/// N(x).
pub fn weight(x: f64) -> f64 {
    let a = x.abs();
    if a < 0.5 {
        0.75 - a * a
    } else if a < 1.5 {
        0.5 * (1.5 - a).powi(2)
    } else {
        0.0
    }
}

/// dN/dx.
pub fn slope(x: f64) -> f64 {
    let a = x.abs();
    if a < 0.5 {
        -2.0 * x
    } else if a < 1.5 {
        (a - 1.5) * x.signum()
    } else {
        0.0
    }
}

/// What a node is to a point.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// Node.
    pub node: [i64; 3],
    /// N at the point.
    pub weight: f64,
    /// ∇N at the point [1/m].
    pub gradient: Vec3,
    /// Node minus point [m].
    pub offset: Vec3,
}

/// All nodes closer than 1.5 cells along every axis.
pub fn reach(grid: &Grid, x: &[f32; 3]) -> Vec<Reach> {
    let dx = f64::from(grid.dx);
    let place = (vec3(x) - vec3(&grid.origin)) / dx;
    let nearest = place.map(|c| c.round() as i64);
    let mut found = Vec::with_capacity(27);
    for k in -2..=2 {
        for j in -2..=2 {
            for i in -2..=2 {
                let node = [nearest[0] + i, nearest[1] + j, nearest[2] + k];
                let away = place - Vec3::new(node[0] as f64, node[1] as f64, node[2] as f64);
                let n = away.map(weight);
                let w = n.product();
                if w > 0.0 {
                    let d = away.map(slope) / dx;
                    let gradient = Vec3::new(d[0] * n[1] * n[2], n[0] * d[1] * n[2], n[0] * n[1] * d[2]);
                    found.push(Reach { node, weight: w, gradient, offset: -away * dx });
                }
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_are_a_partition_of_unity_that_reproduces_linear_functions() {
        let grid = crate::proof::cloud::grid();
        let all = reach(&grid, &[0.1, 0.5, 0.3]);
        let sum: f64 = all.iter().map(|r| r.weight).sum();
        let moment: Vec3 = all.iter().map(|r| r.weight * r.offset).sum();
        let gradient = all.iter().fold(super::super::Mat3::zeros(), |m, r| m + r.offset * r.gradient.transpose());
        assert!(all.len() == 27 && (sum - 1.0).abs() < 1e-14 && moment.norm() < 1e-16);
        assert!((gradient - super::super::Mat3::identity()).norm() < 1e-13);
        assert!((slope(0.7) - (weight(0.7 + 1e-6) - weight(0.7 - 1e-6)) / 2e-6).abs() < 1e-9);
    }
}

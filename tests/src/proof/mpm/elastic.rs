//! Hyperelastic materials in f64: energies from the literature, and the stress that belongs to each.

use physvideo_gpu::kernels::Body;

use super::{Mat3, Vec3};

/// Rotation of F = R S with det R = +1; the smallest singular value carries the sign (Irving 2004).
pub fn rotation(f: &Mat3) -> Mat3 {
    let svd = f.svd(true, true);
    let (mut u, v) = (svd.u.unwrap_or_else(Mat3::identity), svd.v_t.unwrap_or_else(Mat3::identity));
    if (u * v).determinant() < 0.0 {
        let least = svd.singular_values.imin();
        let flipped: Vec3 = -u.column(least);
        u.set_column(least, &flipped);
    }
    u * v
}

/// Kirchhoff stress τ = P Fᵀ [Pa] and energy per volume at rest [J/m³].
pub fn stress(body: &Body, f: &Mat3) -> (Mat3, f64) {
    let (mu, lambda) = (f64::from(body.mu), f64::from(body.lambda));
    let j = f.determinant();
    match body.material {
        // Fixed-corotated (Stomakhin 2012): ψ = μ ‖F − R‖² + λ/2 (J − 1)², P = 2μ (F − R) + λ (J − 1) J F⁻ᵀ.
        1 => {
            let apart = f - rotation(f);
            let tau = 2.0 * mu * apart * f.transpose() + Mat3::identity() * (lambda * (j - 1.0) * j);
            (tau, mu * apart.norm_squared() + 0.5 * lambda * (j - 1.0).powi(2))
        }
        // Neo-Hookean (Bonet & Wood): ψ = μ/2 (tr FᵀF − 3) − μ ln J + λ/2 ln² J, P = μ (F − F⁻ᵀ) + λ ln J F⁻ᵀ.
        2 => {
            let ln = j.ln();
            let tau = mu * (f * f.transpose() - Mat3::identity()) + Mat3::identity() * (lambda * ln);
            (tau, 0.5 * mu * ((f.transpose() * f).trace() - 3.0) - mu * ln + 0.5 * lambda * ln * ln)
        }
        _ => (Mat3::zeros(), 0.0),
    }
}

#[cfg(test)]
mod tests {
    use super::super::bodies;
    use super::*;

    #[test]
    fn stress_is_the_derivative_of_the_energy() {
        let f = Mat3::new(1.1, 0.2, -0.1, 0.05, 0.9, 0.3, -0.2, 0.1, 1.2);
        let all = bodies();
        for body in &all[..all.len() - 1] {
            let (tau, _) = stress(body, &f);
            assert!(tau.norm() > 1.0, "material {} has no twin here", body.material);
            let p = tau * f.try_inverse().unwrap().transpose();
            for i in 0..9 {
                let (mut more, mut less) = (f, f);
                more[i] += 1e-6;
                less[i] -= 1e-6;
                let slope = (stress(body, &more).1 - stress(body, &less).1) / 2e-6;
                assert!((slope - p[i]).abs() < 1e-4 * p.norm(), "{i}: {slope} {}", p[i]);
            }
        }
    }

    #[test]
    fn rotation_of_a_reflection_is_a_rotation() {
        let r = rotation(&Mat3::from_diagonal(&Vec3::new(2.0, 1.0, -0.5)));
        assert!((r - Mat3::identity()).norm() < 1e-12);
    }
}

//! Materials in f64: energies and yield surfaces from the literature, the stress that belongs to each, and the return
//! to the surface by its closed form.

use physvideo_gpu::kernels::Body;
use physvideo_gpu::kernels::family::material::{COROTATED, LIQUID, NEO_HOOKEAN, PLASTIC, SAND, SNOW};

use super::{Mat3, Vec3};
use crate::proof::lagrangian::squash;

/// What a material makes of a trial deformation.
#[derive(Clone, Debug)]
pub struct Response {
    /// Kirchhoff stress τ = P Fᵀ [Pa].
    pub tau: Mat3,
    /// What is left of F.
    pub f: Mat3,
    /// What it remembers.
    pub memory: f64,
    /// Energy per volume at rest [J/m³].
    pub energy: f64,
    /// How much faster waves are than at rest.
    pub wave: f64,
}

/// F = U diag(σ) Vᵀ with rotations U and V; the smallest singular value carries the sign (Irving 2004).
pub fn svd(f: &Mat3) -> (Mat3, Vec3, Mat3) {
    let svd = f.svd(true, true);
    let u = svd.u.unwrap_or_else(Mat3::identity);
    let v = svd.v_t.unwrap_or_else(Mat3::identity).transpose();
    let mut s = svd.singular_values;
    let least = s.imin();
    // Turning a vector and its value around together changes nothing of the product.
    let mut proper = |mut m: Mat3| {
        if m.determinant() < 0.0 {
            m.column_mut(least).neg_mut();
            s[least] = -s[least];
        }
        m
    };
    let (u, v) = (proper(u), proper(v));
    (u, s, v)
}

/// Rotation of F = R S with det R = +1.
pub fn rotation(f: &Mat3) -> Mat3 {
    let (u, _, v) = svd(f);
    u * v.transpose()
}

/// Work over λ of the pressure b that fixed-corotated bodies gain below a third of their volume: ∫ b dJ by Simpson's rule.
fn squash_energy(j: f64) -> f64 {
    // Between its kinks at 0.05 and 0 the pressure is a line, and the same below.
    let k = j.max(0.05);
    let line = 0.5 * (k - j.clamp(0.0, k)) * (squash(k).0 + squash(j.clamp(0.0, k)).0) - j.min(0.0) * squash(0.0).0;
    let (n, h) = (2000, (1.0 / 3.0 - k) / 2000.0);
    if h <= 0.0 {
        return 0.0;
    }
    let weight = |i: i32| if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
    (0..=n).map(|i| weight(i) * squash(k + f64::from(i) * h).0).sum::<f64>() * h / 3.0 + line
}

/// The material's answer to a trial deformation, `memory` and velocity gradient [1/s].
pub fn respond(body: &Body, f: &Mat3, memory: f64, gradient: &Mat3) -> Response {
    let (mu, lambda) = (f64::from(body.mu), f64::from(body.lambda));
    let p = body.p.map(f64::from);
    let j = f.determinant();
    let one = Mat3::identity();
    let elastic = |tau: Mat3, energy: f64, stiffness: f64| Response {
        tau,
        f: *f,
        memory,
        energy,
        wave: (stiffness / (2.0 * mu + lambda)).sqrt(),
    };
    let stretch = f64::max(1.0, f.norm_squared() - 2.0);
    match body.material {
        // Fixed-corotated (Stomakhin 2012): ψ = μ ‖F − R‖² + λ/2 (J − 1)², P = 2μ (F − R) + λ (J − 1) J F⁻ᵀ, and more
        // below a third of the volume.
        COROTATED => {
            let apart = f - rotation(f);
            let (more, slope) = squash(j);
            let tau = 2.0 * mu * apart * f.transpose() + one * (lambda * (j - 1.0 - more) * j);
            let swells = j * (2.0 * j - 1.0 - more + j * slope);
            let stiffness = 2.0 * mu * (2.0 * stretch - stretch.sqrt()) + lambda * swells.max(1.0);
            let volume = 0.5 * (j - 1.0).powi(2) + squash_energy(j);
            elastic(tau, mu * apart.norm_squared() + lambda * volume, stiffness)
        }
        // Neo-Hookean (Bonet & Wood): ψ = μ/2 (tr FᵀF − 3) − μ ln J + λ/2 ln² J, P = μ (F − F⁻ᵀ) + λ ln J F⁻ᵀ.
        NEO_HOOKEAN => {
            let ln = j.ln();
            let tau = mu * (f * f.transpose() - one) + one * (lambda * ln);
            let energy = 0.5 * mu * ((f.transpose() * f).trace() - 3.0) - mu * ln + 0.5 * lambda * ln * ln;
            elastic(tau, energy, 2.0 * mu * stretch + lambda)
        }
        // Von Mises: √(3/2) ‖dev τ‖ ≤ σ_y + H α; the return keeps the direction of dev ε (radial return, Simo 1992).
        PLASTIC => {
            let (u, s, v) = svd(f);
            let strain = s.map(|s| s.max(0.02).ln());
            let (dev, mean) = split(&strain);
            let equivalent = 1.5_f64.sqrt() * 2.0 * mu * dev.norm();
            let over = equivalent - (p[0] + p[1] * memory);
            // Each unit of plastic strain lowers the equivalent stress by 3μ and raises the limit by H.
            let more = f64::max(0.0, over / (3.0 * mu + p[1]));
            let kept = if dev.norm() > 0.0 { 1.0 - 3.0 * mu * more / equivalent } else { 1.0 };
            hencky(body, &u, &(dev * kept + mean), &v, memory + more)
        }
        // Snow (Stomakhin 2013, eqs. 9–11): F_E clamped to [1 − θc, 1 + θs], F_P takes the rest, moduli e^ξ(1 − J_P).
        SNOW => {
            let (u, s, v) = svd(f);
            let kept = s.map(|s| s.clamp(1.0 - p[0], 1.0 + p[1]));
            let packed = (1.0 + memory) * f64::max(s.product(), 0.0) / kept.product();
            let packed = packed.clamp(p[3], 20.0);
            let hard = (p[2] * (1.0 - packed)).exp();
            let f_e = u * Mat3::from_diagonal(&kept) * v.transpose();
            let (apart, j_e) = (f_e - u * v.transpose(), kept.product());
            let tau = hard * (2.0 * mu * apart * f_e.transpose() + one * (lambda * (j_e - 1.0) * j_e));
            let energy = hard * (mu * apart.norm_squared() + 0.5 * lambda * (j_e - 1.0).powi(2));
            Response { tau, f: f_e, memory: packed - 1.0, energy, wave: hard.sqrt() }
        }
        // Drucker–Prager (Klár 2016, sec. 7): expansion to the apex, else ‖dev ε‖ ≤ −α (3λ + 2μ)/(2μ) tr ε.
        SAND => {
            let (u, s, v) = svd(f);
            let strain = s.map(|s| s.max(0.02).ln()).add_scalar(memory / 3.0);
            let trace = strain.sum();
            if trace >= 0.0 {
                return hencky(body, &u, &Vec3::zeros(), &v, trace);
            }
            let (dev, mean) = split(&strain);
            let limit = -p[0] * (3.0 * lambda + 2.0 * mu) / (2.0 * mu) * trace;
            let kept = if dev.norm() > limit { limit / dev.norm() } else { 1.0 };
            hencky(body, &u, &(dev * kept + mean), &v, 0.0)
        }
        // Cole's equation of state p = K/γ (J^−γ − 1), no tension; Newtonian shear stress σ = η (∇v + ∇vᵀ − ⅔ tr I).
        LIQUID => {
            let j = f64::max(f[0], 1e-3);
            let (dense, gamma) = (j.min(1.0), p[0]);
            let pressure = lambda / gamma * (dense.powf(-gamma) - 1.0);
            let shear = gradient + gradient.transpose() - one * (2.0 / 3.0 * gradient.trace());
            let tau = dense * p[1] * shear - one * (dense * pressure);
            // ψ = −∫ p dJ from 1 to J.
            let energy = lambda / gamma * ((dense.powf(1.0 - gamma) - 1.0) / (gamma - 1.0) + dense - 1.0);
            // K ((γ − 1) J^(1−γ) + J)/γ is dτ/d ln J.
            let wave = (((gamma - 1.0) * dense.powf(1.0 - gamma) + dense) / gamma).sqrt();
            let mut kept = Mat3::zeros();
            kept[0] = j;
            Response { tau, f: kept, memory: 0.0, energy, wave }
        }
        _ => Response { tau: Mat3::zeros(), f: *f, memory, energy: 0.0, wave: 1.0 },
    }
}

/// Deviator and mean of a principal strain.
fn split(strain: &Vec3) -> (Vec3, Vec3) {
    let mean = Vec3::repeat(strain.mean());
    (strain - mean, mean)
}

/// ψ = μ Σ ε² + λ/2 (Σ ε)² of the principal logarithmic strain.
fn hencky(body: &Body, u: &Mat3, strain: &Vec3, v: &Mat3, memory: f64) -> Response {
    let (mu, lambda) = (f64::from(body.mu), f64::from(body.lambda));
    let principal = (2.0 * mu * strain).add_scalar(lambda * strain.sum());
    Response {
        tau: u * Mat3::from_diagonal(&principal) * u.transpose(),
        f: u * Mat3::from_diagonal(&strain.map(f64::exp)) * v.transpose(),
        memory,
        energy: mu * strain.norm_squared() + 0.5 * lambda * strain.sum().powi(2),
        wave: 1.0,
    }
}

/// Largest stress the terms of a response are made of, to which their rounding is relative [Pa].
pub fn stiffness(body: &Body, f: &Mat3, answer: &Response) -> f64 {
    let viscous = f64::from(body.p[1]) * if body.material == LIQUID { 100.0 } else { 0.0 };
    f64::from(body.mu + body.lambda) * answer.wave.powi(2) * (1.0 + f.norm_squared()) + viscous
}

#[cfg(test)]
mod tests {
    use super::super::bodies;
    use super::*;

    /// Deformations within every yield surface of `bodies`, squeezed for sand.
    fn gentle() -> Mat3 {
        Mat3::new(0.985, 0.004, -0.006, 0.004, 0.98, 0.003, -0.006, 0.003, 0.99)
    }

    #[test]
    fn stress_is_the_derivative_of_the_energy() {
        let all = bodies();
        for body in &all[..all.len() - 1] {
            let elastic = [COROTATED, NEO_HOOKEAN].contains(&body.material);
            let f = if elastic { Mat3::new(1.1, 0.2, -0.1, 0.05, 0.9, 0.3, -0.2, 0.1, 1.2) } else { gentle() };
            let of = |f: &Mat3| respond(body, f, 0.0, &Mat3::zeros());
            let answer = of(&f);
            assert!(answer.tau.norm() > 1.0, "material {} has no twin here", body.material);
            if body.material == LIQUID {
                // F is J alone: dψ/d ln J = tr τ / 3.
                let h = 1e-6;
                let at = |scale: f64| of(&(f * scale)).energy;
                let slope = (at(1.0 + h) - at(1.0 - h)) / (2.0 * h);
                assert!((slope - answer.tau.trace() / 3.0).abs() < 1e-4 * answer.tau.norm(), "liquid: {slope}");
                continue;
            }
            assert!((answer.f - f).norm() < 1e-12, "material {} yields", body.material);
            let p = answer.tau * f.try_inverse().unwrap().transpose();
            for i in 0..9 {
                let (mut more, mut less) = (f, f);
                more[i] += 1e-6;
                less[i] -= 1e-6;
                let slope = (of(&more).energy - of(&less).energy) / 2e-6;
                assert!((slope - p[i]).abs() < 1e-4 * p.norm(), "{}, {i}: {slope} {}", body.material, p[i]);
            }
        }
    }

    /// A state that was returned to the yield surface stays where it is, and carries what the surface allows.
    #[test]
    fn a_return_is_made_once() {
        let f = Mat3::new(0.7, 0.3, -0.1, 0.0, 1.1, 0.2, -0.2, 0.1, 0.8);
        for body in bodies().iter().filter(|b| [PLASTIC, SNOW, SAND].contains(&b.material)) {
            let once = respond(body, &f, 0.0, &Mat3::zeros());
            assert!((once.f - f).norm() > 0.05, "material {} does not yield", body.material);
            let twice = respond(body, &once.f, once.memory, &Mat3::zeros());
            assert!((twice.f - once.f).norm() < 1e-9 && (twice.memory - once.memory).abs() < 1e-9);
            assert!((twice.tau - once.tau).norm() < 1e-9 * once.tau.norm());
        }
    }

    #[test]
    fn rotation_of_a_reflection_is_a_rotation() {
        let r = rotation(&Mat3::from_diagonal(&Vec3::new(2.0, 1.0, -0.5)));
        assert!((r - Mat3::identity()).norm() < 1e-12);
    }

    #[test]
    fn singular_values_rebuild_the_matrix() {
        let mut random = crate::random::Random::new(5);
        for i in 0..2000 {
            let mut f = Mat3::from_fn(|_, _| f64::from(random.range(-1.0, 1.0)));
            if i % 3 == 0 {
                f.set_column(2, &(f.column(0) * 0.5));
            }
            let (u, s, v) = svd(&f);
            assert!((u.determinant() - 1.0).abs() < 1e-9 && (v.determinant() - 1.0).abs() < 1e-9);
            assert!((u * Mat3::from_diagonal(&s) * v.transpose() - f).norm() < 1e-9, "{f} {u} {s} {v}");
        }
    }
}

//! member 2 of fn (b: Body, f: mat3x3f) -> Stress = Stress(mat3x3f(), 0.0)
//! use lib/particle
// Compressible neo-Hookean: ψ = μ/2 (‖F‖² − 3) − μ ln J + λ/2 ln² J, τ = μ (F Fᵀ − I) + λ ln J I.

fn material_neo_hookean(b: Body, f: mat3x3f) -> Stress {
    let j = max(dot(f[0], cross(f[1], f[2])), 1e-3);   // the logarithm needs J > 0; G2P counts such particles
    let lnj = log(j);
    let d = b.lambda * lnj - b.mu;
    let tau = b.mu * (f * transpose(f)) + mat3x3f(d, 0.0, 0.0, 0.0, d, 0.0, 0.0, 0.0, d);
    let i1 = dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2]);
    return Stress(tau, 0.5 * b.mu * (i1 - 3.0) - b.mu * lnj + 0.5 * b.lambda * lnj * lnj);
}

//! member 2 of fn (b: Body, t: Trial) -> Response = inert(t)
//! use lib/particle
// Compressible neo-Hookean: ψ = μ/2 (‖F‖² − 3) − μ ln J + λ/2 ln² J, τ = μ (F Fᵀ − I) + λ ln J I.

fn material_neo_hookean(b: Body, t: Trial) -> Response {
    let f = t.f;
    let j = max(dot(f[0], cross(f[1], f[2])), 1e-3);   // the logarithm needs J > 0; G2P counts such particles
    let lnj = log(j);
    let tau = b.mu * (f * transpose(f)) + diagonal(vec3f(b.lambda * lnj - b.mu));
    let i1 = dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2]);
    let energy = 0.5 * b.mu * (i1 - 3.0) - b.mu * lnj + 0.5 * b.lambda * lnj * lnj;
    // dτ/d ln σ = 2μ σ² + λ along a stretch σ, as in the fixed-corotated material.
    let stiffness = 2.0 * b.mu * max(1.0, i1 - 2.0) + b.lambda;
    return Response(tau, f, t.memory, energy, sqrt(stiffness / (2.0 * b.mu + b.lambda)));
}

//! use lib/svd lib/particle
// Quadratic energy of the logarithmic (Hencky) strain: ψ = μ Σ ε² + λ/2 (Σ ε)², τ = 2μ ε + λ (Σ ε) along the principal
// axes. Return maps of plasticity are simple in it (Simo 1992; Klár 2016).

// Logarithms of the singular values; flat and inverted particles count as squeezed to a fiftieth.
fn log_strain(s: vec3f) -> vec3f {
    return log(max(s, vec3f(0.02)));
}

fn hencky(b: Body, a: Svd, strain: vec3f, memory: f32) -> Response {
    let trace = strain.x + strain.y + strain.z;
    let tau = spread(a.u, 2.0 * b.mu * strain + vec3f(b.lambda * trace));
    let energy = b.mu * dot(strain, strain) + 0.5 * b.lambda * trace * trace;
    return Response(tau, recompose(a.u, exp(strain), a.v), memory, energy, 1.0);
}

//! use lib/svd lib/particle
// Quadratic energy of the logarithmic (Hencky) strain: ψ = μ Σ ε² + λ/2 (Σ ε)², τ = 2μ ε + λ (Σ ε) along the principal
// axes. Return maps of plasticity are simple in it (Simo 1992; Klár 2016).

// Singular values below which flat and inverted particles count as squeezed to a fiftieth.
const LEAST_STRETCH: f32 = 0.02;

// Logarithms of the singular values. Near 1, where a driver's own is right to 1e-7 of 1 and not of the strain, by
// log s = 2 artanh z, z = (s - 1)/(s + 1); the next term is z^9/9 < 1e-9 of z.
fn log_strain(s: vec3f) -> vec3f {
    let z = (s - vec3f(1.0)) / (s + vec3f(1.0));
    let q = z * z;
    let near = 2.0 * z * (vec3f(1.0) + q * (vec3f(1.0 / 3.0) + q * (vec3f(0.2) + q * (1.0 / 7.0))));
    return select(log(max(s, vec3f(LEAST_STRETCH))), near, abs(z) < vec3f(0.1));
}

// And back, as far as the series is right to 1e-8: a driver's own may be off by as much as a step moves.
fn exp_strain(e: vec3f) -> vec3f {
    let one = vec3f(1.0);
    let near = one + e * (one + e / 2.0 * (one + e / 3.0 * (one + e / 4.0 * (one + e / 5.0 * (one + e / 6.0)))));
    return select(exp(e), near, abs(e) < vec3f(0.25));
}

fn hencky(b: Body, a: Svd, strain: vec3f, memory: f32) -> Response {
    let trace = strain.x + strain.y + strain.z;
    let tau = spread(a.u, 2.0 * b.mu * strain + vec3f(b.lambda * trace));
    let energy = b.mu * dot(strain, strain) + 0.5 * b.lambda * trace * trace;
    return Response(tau, recompose(a.u, exp_strain(strain), a.v), memory, energy, 1.0);
}

// Where nothing flowed F stays as it was: through its logarithm and back, rounding would let it creep from step to step.
fn unmoved(r: Response, t: Trial, a: Svd) -> Response {
    var out = r;
    if (a.s.z > LEAST_STRETCH) { out.f = t.f; }
    return out;
}

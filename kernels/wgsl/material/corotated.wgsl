//! member 1 of fn (b: Body, t: Trial) -> Response = inert(t)
//! use lib/particle lib/polar lib/squash
// Fixed-corotated elasticity (Stomakhin 2012): ψ = μ ‖F − R‖² + λ/2 (J − 1)², τ = 2μ (F − R) Fᵀ + λ J (J − 1) I; below a
// third of the volume more (`lib/squash`).

fn material_corotated(b: Body, t: Trial) -> Response {
    let f = t.f;
    let p = polar(f);
    let j = dot(f[0], cross(f[1], f[2]));
    var e = f - p.r;
    if (!p.ok) { e = mat3x3f(); }   // no rotation is defined there; the volume term still pushes back
    let more = squash(j);
    let tau = 2.0 * b.mu * (e * transpose(f)) + diagonal(vec3f(b.lambda * j * (j - 1.0 - more.x)));
    let shear = dot(e[0], e[0]) + dot(e[1], e[1]) + dot(e[2], e[2]);
    let energy = b.mu * shear + b.lambda * (0.5 * (j - 1.0) * (j - 1.0) + squash_energy(j));
    // dτ/d ln σ = 2μ σ (2σ − 1) + λ (J (2J − 1) − J b − J² b') along a stretch σ; ‖F‖² − 2 is σ² where the others are at rest.
    let stretch = max(1.0, dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2]) - 2.0);
    let stiffness = 2.0 * b.mu * (2.0 * stretch - sqrt(stretch)) + b.lambda * max(1.0, j * (2.0 * j - 1.0 - more.x + j * more.y));
    return Response(tau, f, t.memory, energy, sqrt(stiffness / (2.0 * b.mu + b.lambda)));
}

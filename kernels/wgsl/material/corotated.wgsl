//! member 1 of fn (b: Body, f: mat3x3f) -> Stress = Stress(mat3x3f(), 0.0)
//! use lib/particle lib/polar
// Fixed-corotated elasticity (Stomakhin 2012): ψ = μ ‖F − R‖² + λ/2 (J − 1)², τ = 2μ (F − R) Fᵀ + λ J (J − 1) I.

fn material_corotated(b: Body, f: mat3x3f) -> Stress {
    let p = polar(f);
    let j = dot(f[0], cross(f[1], f[2]));
    var e = f - p.r;
    if (!p.ok) { e = mat3x3f(); }   // no rotation is defined there; the volume term still pushes back
    let pressure = b.lambda * j * (j - 1.0);
    let tau = 2.0 * b.mu * (e * transpose(f)) + mat3x3f(pressure, 0.0, 0.0, 0.0, pressure, 0.0, 0.0, 0.0, pressure);
    let shear = dot(e[0], e[0]) + dot(e[1], e[1]) + dot(e[2], e[2]);
    return Stress(tau, b.mu * shear + 0.5 * b.lambda * (j - 1.0) * (j - 1.0));
}

//! member 3 of fn (b: Body, t: Trial) -> Response = inert(t)
//! use lib/hencky
// Von Mises plasticity with linear isotropic hardening (Simo 1992): √(3/2) ‖dev τ‖ ≤ σ_y + H α. p.x: yield stress σ_y,
// p.y: hardening modulus H, both [Pa]; the memory is the accumulated plastic strain α.

fn material_plastic(b: Body, t: Trial) -> Response {
    let a = svd(t.f);
    let strain = log_strain(a.s);
    let mean = (strain.x + strain.y + strain.z) / 3.0;
    let shear = strain - vec3f(mean);
    let size = length(shear);
    // How far 2μ ‖dev ε‖ is beyond √(2/3) (σ_y + H α), and the flow that brings both together.
    let beyond = 2.0 * b.mu * size - 0.81649658 * (b.p.x + b.p.y * t.memory);
    if (beyond <= 0.0) { return unmoved(hencky(b, a, strain, t.memory), t, a); }
    let flow = beyond / (2.0 * b.mu + 0.66666667 * b.p.y);
    return hencky(b, a, vec3f(mean) + shear * (1.0 - flow / size), t.memory + 0.81649658 * flow);
}

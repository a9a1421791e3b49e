//! member 6 of fn (b: Body, t: Trial) -> Response = inert(t)
//! use lib/particle
// Nearly incompressible Newtonian liquid: p = K/γ (J^−γ − 1) (Cole 1948), τ = −J p I + J η (∇v + ∇vᵀ − ⅔ ∇·v I). It
// does not pull: J > 1 is a free surface, where it counts as 1, for spray would else be ever more viscous. λ holds K, p.x: γ, p.y: viscosity η [Pa s]. Of F only J is kept, in f[0].x.

fn material_liquid(b: Body, t: Trial) -> Response {
    let j = max(t.f[0].x, 1e-3);
    let dense = min(j, 1.0);
    let gamma = b.p.x;
    let power = pow(dense, 1.0 - gamma);    // J^(1 − γ)
    let push = b.lambda / gamma * (power - dense);
    let g = t.gradient;
    let spin = g + transpose(g) - diagonal(vec3f((2.0 / 3.0) * (g[0].x + g[1].y + g[2].z)));
    let tau = (dense * b.p.y) * spin - diagonal(vec3f(push));
    // ∫ p dJ from J to 1; dτ/d ln J for the speed of sound.
    let energy = b.lambda / gamma * ((power - 1.0) / (gamma - 1.0) + dense - 1.0);
    return Response(tau, mat3x3f(vec3f(j, 0.0, 0.0), vec3f(0.0), vec3f(0.0)), t.memory, energy,
        sqrt(((gamma - 1.0) * power + dense) / gamma));
}

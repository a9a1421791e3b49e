//! member 4 of fn (b: Body, t: Trial) -> Response = inert(t)
//! use lib/svd lib/particle
// Snow (Stomakhin 2013): fixed-corotated, singular values of the elastic part kept within [1 − θc, 1 + θs], what goes
// beyond is plastic volume J_p, and both moduli grow as exp(ξ (1 − J_p)). p.x: θc, p.y: θs, p.z: ξ, p.w: the least J_p,
// below which it hardens no more; the memory is J_p − 1.

fn material_snow(b: Body, t: Trial) -> Response {
    let a = svd(t.f);
    let s = clamp(a.s, vec3f(1.0 - b.p.x), vec3f(1.0 + b.p.y));
    let j = s.x * s.y * s.z;
    let volume = clamp((1.0 + t.memory) * max(a.s.x * a.s.y * a.s.z, 0.0) / j, b.p.w, 20.0);
    let harder = exp(b.p.z * (1.0 - volume));
    let e = s - vec3f(1.0);
    let mu = harder * b.mu;
    let lambda = harder * b.lambda;
    let tau = spread(a.u, 2.0 * mu * e * s + vec3f(lambda * j * (j - 1.0)));
    let energy = mu * dot(e, e) + 0.5 * lambda * (j - 1.0) * (j - 1.0);
    // Where nothing flowed F stays as it was: taken apart and put together it would creep from step to step.
    var f = recompose(a.u, s, a.v);
    if (all(s == a.s)) { f = t.f; }
    return Response(tau, f, volume - 1.0, energy, sqrt(harder));
}

//! member 5 of fn (b: Body, t: Trial) -> Response = inert(t)
//! use lib/hencky
// Dry sand (Klár 2016): Drucker–Prager in Hencky strain, with volume correction: sand that expands carries nothing,
// remembers by how much it did, and must be compressed by that before it carries again. p.x: α = √(2/3) 2 sin φ /
// (3 − sin φ); the memory is the logarithmic volume it has expanded by.

fn material_sand(b: Body, t: Trial) -> Response {
    let a = svd(t.f);
    let strain = log_strain(a.s) + vec3f(t.memory / 3.0);
    let trace = strain.x + strain.y + strain.z;
    if (trace >= 0.0) { return hencky(b, a, vec3f(0.0), trace); }
    let shear = strain - vec3f(trace / 3.0);
    let size = length(shear);
    // ‖dev τ‖ ≤ −α (3λ + 2μ) tr ε.
    let most = -b.p.x * (3.0 * b.lambda + 2.0 * b.mu) / (2.0 * b.mu) * trace;
    if (size <= most && t.memory == 0.0) { return unmoved(hencky(b, a, strain, 0.0), t, a); }
    let kept = select(1.0, most / size, size > most);
    return hencky(b, a, vec3f(trace / 3.0) + kept * shear, 0.0);
}

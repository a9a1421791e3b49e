//! member 6 of fn (f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f = vec3f(0.0)
//! use lib/hash
// Value noise (Perlin & Hoffert 1989): random vectors on a lattice of spacing a.w [m] and b.x [s], interpolated in space
// and time, so that a push changes smoothly. Each component has mean 0 and, by the division at the end, the same variance
// at every place: (a (p0 + p1 (z − p2)))² [m²/s⁴]. b.y and b.z choose where in the endless lattice it is taken from.

fn field_noise(f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f {
    let size = f.p0 + f.p1 * (x.z - f.p2);
    if (size <= 0.0) { return vec3f(0.0); }
    let at = vec4f(x / f.a.w, t / f.b.x);
    let cell = floor(at);
    let s = at - cell;
    let high = s * s * (3.0 - 2.0 * s);
    let low = 1.0 - high;
    let first = pcg4d(vec4u(u32(f.b.y), u32(f.b.z), 0u, 0u)) + bitcast<vec4u>(vec4i(cell));
    var sum = vec3f(0.0);
    for (var i = 0u; i < 16u; i++) {
        let corner = vec4u(i, i >> 1u, i >> 2u, i >> 3u) & vec4u(1u);
        let w = select(low, high, corner == vec4u(1u));
        // Uniform in ±2³¹.
        sum += (w.x * w.y * w.z * w.w) * vec3f(bitcast<vec3i>(pcg4d(first + corner).xyz));
    }
    // A sum with weights w of values of variance 1 has the variance Σ w², a product over the axes.
    let n = low * low + high * high;
    return (size * sqrt(3.0 / (n.x * n.y * n.z * n.w)) / 2147483648.0) * f.a.xyz * sum;
}

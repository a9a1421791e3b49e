//! member 2 of fn (b: Solid, f: Four) -> Piola = Piola(Four(), vec4f())
//! use lib/polar lib/reference
// Compressible neo-Hookean: P = μ F + (λ ln J − μ) cof F / J. Below the least volume the factor of
// cof F goes on along its tangent: the stress stays finite and pushes back through J = 0.

fn piola_neo_hookean(b: Solid, f: Four) -> Piola {
    let c = Four(cofactor(f.a), cofactor(f.b), cofactor(f.c), cofactor(f.d));
    let all = vec4f(dot(f.a[0], c.a[0]), dot(f.b[0], c.b[0]), dot(f.c[0], c.c[0]), dot(f.d[0], c.d[0]));
    let j = max(all, vec4f(LEAST_VOLUME));
    let wide = vec4f(squares(c.a), squares(c.b), squares(c.c), squares(c.d));
    let lnj = log(j);
    let slope = (b.lambda * (1.0 - lnj) + b.mu) / (j * j);
    let q = (b.lambda * lnj - b.mu) / j + slope * (all - j);
    let p = Four(b.mu * f.a + q.x * c.a, b.mu * f.b + q.y * c.b, b.mu * f.c + q.z * c.c, b.mu * f.d + q.w * c.d);
    return Piola(p, b.mu + (b.lambda * max(1.0 - lnj, vec4f(0.0)) + b.mu) * widest(wide) / (j * j));
}

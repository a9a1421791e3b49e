//! member 2 of fn (b: Solid, f: mat3x3f) -> Piola = Piola(mat3x3f(), 0.0)
//! use lib/polar lib/reference
// Compressible neo-Hookean: P = μ F + (λ ln J − μ) cof F / J. Below the least volume the logarithm and the quotient keep
// their values: the stress stays finite and pushes back through J = 0.

fn piola_neo_hookean(b: Solid, f: mat3x3f) -> Piola {
    let c = cofactor(f);
    let j = max(dot(f[0], c[0]), LEAST_VOLUME);
    let lnj = log(j);
    let p = b.mu * f + ((b.lambda * lnj - b.mu) / j) * c;
    return Piola(p, b.mu + (b.lambda * max(1.0 - lnj, 0.0) + b.mu) * widest(c) / (j * j));
}

//! member 1 of fn (b: Solid, f: mat3x3f) -> Piola = Piola(mat3x3f(), 0.0)
//! use lib/polar lib/reference
// Fixed-corotated elasticity (Stomakhin 2012): P = 2μ (F − R) + λ (J − 1) cof F. Written for P itself, which is smooth
// where F has no inverse; the Kirchhoff stress of `material/corotated` is P Fᵀ.

fn piola_corotated(b: Solid, f: mat3x3f) -> Piola {
    let turn = polar(f);
    let c = cofactor(f);
    var e = f - turn.r;
    if (!turn.ok) { e = mat3x3f(); }   // no rotation is defined there; the volume term still pushes back
    let p = (2.0 * b.mu) * e + (b.lambda * (dot(f[0], c[0]) - 1.0)) * c;
    return Piola(p, 2.0 * b.mu + b.lambda * widest(c));
}

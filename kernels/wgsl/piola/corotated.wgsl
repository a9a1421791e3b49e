//! member 1 of fn (b: Solid, f: Four) -> Piola = Piola(Four(), vec4f())
//! use lib/polar lib/reference lib/squash
// Fixed-corotated elasticity (Stomakhin 2012): P = 2μ (F − R) + λ (J − 1) cof F, and more below a third of the volume.
// Written for P itself, which is smooth where F has no inverse; the Kirchhoff stress of `material/corotated` is P Fᵀ.

fn corotated_at(b: Solid, f: mat3x3f, c: mat3x3f, volume: f32, trace: f32) -> mat3x3f {
    let turn = rotation(f, c, trace);
    var e = f - turn.r;
    if (!turn.ok) { e = mat3x3f(); }   // no rotation is defined there; the volume term still pushes back
    return (2.0 * b.mu) * e + (b.lambda * volume) * c;
}

fn piola_corotated(b: Solid, f: Four) -> Piola {
    let c = Four(cofactor(f.a), cofactor(f.b), cofactor(f.c), cofactor(f.d));
    let j = vec4f(dot(f.a[0], c.a[0]), dot(f.b[0], c.b[0]), dot(f.c[0], c.c[0]), dot(f.d[0], c.d[0]));
    let wide = vec4f(squares(c.a), squares(c.b), squares(c.c), squares(c.d));
    let s = traces(vec4f(squares(f.a), squares(f.b), squares(f.c), squares(f.d)), wide, j);
    let ka = squash(j.x);
    let kb = squash(j.y);
    let kc = squash(j.z);
    let kd = squash(j.w);
    let volume = j - 1.0 - vec4f(ka.x, kb.x, kc.x, kd.x);
    let p = Four(corotated_at(b, f.a, c.a, volume.x, s.x), corotated_at(b, f.b, c.b, volume.y, s.y),
        corotated_at(b, f.c, c.c, volume.z, s.z), corotated_at(b, f.d, c.d, volume.w, s.w));
    return Piola(p, vec4f(2.0 * b.mu) + b.lambda * (1.0 + vec4f(ka.y, kb.y, kc.y, kd.y)) * widest(wide));
}

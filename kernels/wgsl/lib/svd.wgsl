// Singular value decomposition of a 3 × 3 matrix by one-sided Jacobi rotations (Hestenes 1958): columns are turned in
// pairs until they are orthogonal, which keeps small singular values relatively accurate (Demmel & Veselić 1992).

// F = U diag(σ) Vᵀ with rotations U and V, σ1 ≥ σ2 ≥ |σ3|; the sign of σ3 is that of det F (Irving 2004).
struct Svd {
    u: mat3x3f,
    s: vec3f,
    v: mat3x3f,
}

// Cosine of an angle between columns that counts as a right one.
const ORTHOGONAL: f32 = 1e-7;
const MOST_SWEEPS: u32 = 8u;

// Turns columns p and q of B and the same of V; true when it was worth it.
fn svd_turn(p: ptr<function, vec3f>, q: ptr<function, vec3f>, vp: ptr<function, vec3f>, vq: ptr<function, vec3f>) -> bool {
    let a = dot(*p, *p);
    let b = dot(*q, *q);
    let c = dot(*p, *q);
    if (!(abs(c) > ORTHOGONAL * sqrt(a) * sqrt(b)) || c == 0.0) { return false; }
    let zeta = 0.5 * (b - a) / c;
    let t = select(-1.0, 1.0, zeta >= 0.0) / (abs(zeta) + sqrt(1.0 + zeta * zeta));
    let cosine = inverseSqrt(1.0 + t * t);
    let sine = cosine * t;
    let bp = *p;
    let bq = *q;
    *p = cosine * bp - sine * bq;
    *q = sine * bp + cosine * bq;
    let wp = *vp;
    let wq = *vq;
    *vp = cosine * wp - sine * wq;
    *vq = sine * wp + cosine * wq;
    return true;
}

// Puts the longer of two columns first; with the sign of one turned V stays a rotation.
fn svd_order(p: ptr<function, vec3f>, q: ptr<function, vec3f>, vp: ptr<function, vec3f>, vq: ptr<function, vec3f>) {
    if (dot(*p, *p) < dot(*q, *q)) {
        let b = *p;
        *p = *q;
        *q = -b;
        let w = *vp;
        *vp = *vq;
        *vq = -w;
    }
}

fn largest(f: mat3x3f) -> f32 {
    let m = max(abs(f[0]), max(abs(f[1]), abs(f[2])));
    return max(m.x, max(m.y, m.z));
}

fn svd(f: mat3x3f) -> Svd {
    // Squares must neither overflow nor vanish; the tiniest are raised first, because 1 / 1e-40 is infinite.
    let raised = select(1.0, 1.2676506e30, largest(f) < 1e-30);
    let size = largest(raised * f);
    let unit = select(1.0, size, size > 0.0);
    var b0 = (raised * f[0]) / unit;
    var b1 = (raised * f[1]) / unit;
    var b2 = (raised * f[2]) / unit;
    var v0 = vec3f(1.0, 0.0, 0.0);
    var v1 = vec3f(0.0, 1.0, 0.0);
    var v2 = vec3f(0.0, 0.0, 1.0);
    for (var sweep = 0u; sweep < MOST_SWEEPS; sweep++) {
        let xy = svd_turn(&b0, &b1, &v0, &v1);
        let xz = svd_turn(&b0, &b2, &v0, &v2);
        let yz = svd_turn(&b1, &b2, &v1, &v2);
        if (!(xy || xz || yz)) { break; }
    }
    svd_order(&b0, &b1, &v0, &v1);
    svd_order(&b0, &b2, &v0, &v2);
    svd_order(&b1, &b2, &v1, &v2);
    let s0 = length(b0);
    let u0 = select(vec3f(1.0, 0.0, 0.0), b0 / max(s0, 1e-30), s0 > 0.0);
    // Of a column that has all but vanished only its right angle to the first counts.
    let rest = b1 - dot(b1, u0) * u0;
    let s1 = length(rest);
    let other = select(vec3f(0.0, 1.0, 0.0), vec3f(1.0, 0.0, 0.0), abs(u0.x) < 0.7);
    let u1 = select(normalize(other - dot(other, u0) * u0), rest / max(s1, 1e-30), s1 > 1e-18);
    let u2 = cross(u0, u1);
    var out: Svd;
    out.u = mat3x3f(u0, u1, u2);
    out.s = (vec3f(s0, dot(u1, b1), dot(u2, b2)) * unit) / raised;
    out.v = mat3x3f(v0, v1, v2);
    return out;
}

// U diag(d) Uᵀ.
fn spread(u: mat3x3f, d: vec3f) -> mat3x3f {
    return mat3x3f(d.x * u[0], d.y * u[1], d.z * u[2]) * transpose(u);
}

// U diag(d) Vᵀ.
fn recompose(u: mat3x3f, d: vec3f, v: mat3x3f) -> mat3x3f {
    return mat3x3f(d.x * u[0], d.y * u[1], d.z * u[2]) * transpose(v);
}

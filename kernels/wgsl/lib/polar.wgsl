// Rotation of the polar decomposition F = R S with det R = +1, also for inverted F (the smallest singular value
// then carries the sign). The trace of S is the largest root of a quartic (Horn 1987), found by Newton from
// above; R follows from F, its cofactor and F Fᵀ F. Fails only where two singular values cancel, σ2 + σ3 = 0.

struct Polar {
    r: mat3x3f,
    ok: bool,
}

fn cofactor(f: mat3x3f) -> mat3x3f {
    return mat3x3f(cross(f[1], f[2]), cross(f[2], f[0]), cross(f[0], f[1]));
}

// Sum of the squares of the entries: of F it is σ1² + σ2² + σ3², of its cofactor the same of their products.
fn squares(f: mat3x3f) -> f32 {
    return dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2]);
}

// R from F, its cofactor and the trace of S.
fn rotation(f: mat3x3f, c: mat3x3f, s: f32) -> Polar {
    let i1 = squares(f);
    let d = 0.5 * (s * s - i1) * s - dot(f[0], c[0]);     // (σ1+σ2)(σ2+σ3)(σ3+σ1)
    let g = transpose(f) * f;
    var out: Polar;
    out.ok = d > 1e-6 * s * s * s;
    let k = 1.0 / select(1.0, d, out.ok);
    out.r = k * (0.5 * (s * s + i1) * f - f * g + s * c);
    return out;
}

fn polar(f: mat3x3f) -> Polar {
    let c = cofactor(f);
    let j = dot(f[0], c[0]);
    let i1 = squares(f);
    var s = sqrt(3.0 * i1);     // the sum of singular values is at most √3 ‖F‖
    let q0 = i1 * i1 - 4.0 * squares(c);
    for (var k = 0; k < 10; k++) {
        let p = ((s * s - 2.0 * i1) * s - 8.0 * j) * s + q0;
        let dp = (4.0 * s * s - 4.0 * i1) * s - 8.0 * j;
        s = s - select(0.0, p / dp, dp > 1e-30);
    }
    return rotation(f, c, s);
}

// Traces of S of four matrices at once, from ‖F‖², ‖cof F‖² and det F of each. Four quotients are under way together
// where one would wait for the next, so that leaving early pays: one or two rounds where strains are small. The start is
// above the root and nine times nearer than √3 ‖F‖ or better where det F > 0: s² = i1 + 2 t, and t² = i2 + 2 J s.
fn traces(i1: vec4f, i2: vec4f, j: vec4f) -> vec4f {
    var s = sqrt(i1 + 2.0 * sqrt(i2 + 2.0 * max(j, vec4f(0.0)) * sqrt(3.0 * i1)));
    let q0 = i1 * i1 - 4.0 * i2;
    for (var k = 0; k < 12; k++) {
        let p = ((s * s - 2.0 * i1) * s - 8.0 * j) * s + q0;
        let dp = (4.0 * s * s - 4.0 * i1) * s - 8.0 * j;
        let step = select(vec4f(0.0), p / dp, dp > vec4f(1e-30));
        s -= step;
        // Convergence is quadratic: what is left is some 1e-8.
        if (all(abs(step) <= 1e-4 * s)) { break; }
    }
    return s;
}

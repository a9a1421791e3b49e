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

fn polar(f: mat3x3f) -> Polar {
    let c = cofactor(f);
    let j = dot(f[0], c[0]);
    let i1 = dot(f[0], f[0]) + dot(f[1], f[1]) + dot(f[2], f[2]);
    let i2 = dot(c[0], c[0]) + dot(c[1], c[1]) + dot(c[2], c[2]);
    var s = sqrt(3.0 * i1);     // the sum of singular values is at most √3 ‖F‖
    let q0 = i1 * i1 - 4.0 * i2;
    for (var k = 0; k < 10; k++) {
        let p = ((s * s - 2.0 * i1) * s - 8.0 * j) * s + q0;
        let dp = (4.0 * s * s - 4.0 * i1) * s - 8.0 * j;
        s = s - select(0.0, p / dp, dp > 1e-30);
    }
    let d = 0.5 * (s * s - i1) * s - j;     // (σ1+σ2)(σ2+σ3)(σ3+σ1)
    let g = transpose(f) * f;
    var out: Polar;
    out.ok = d > 1e-6 * s * s * s;
    let k = 1.0 / select(1.0, d, out.ok);
    out.r = k * (0.5 * (s * s + i1) * f - f * g + s * c);
    return out;
}

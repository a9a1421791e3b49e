// Quadratic B-spline weights of one axis (Steffen 2008, eq. 23) and their derivatives per cell.

// f: position relative to the base node [cells], in [0.5, 1.5].
fn bspline(f: f32) -> vec3f {
    let a = 1.5 - f;
    let b = f - 1.0;
    let c = f - 0.5;
    return vec3f(0.5 * a * a, 0.75 - b * b, 0.5 * c * c);
}

fn bspline_slope(f: f32) -> vec3f {
    return vec3f(f - 1.5, 2.0 - 2.0 * f, f - 0.5);
}

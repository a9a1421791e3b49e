//! use lib/reference
// Deformation of a point of a body at rest: whoever uses this has `reference`.

// Derivatives of a point from those a cell, and F from those of the displacement.
fn slope(x: vec3f, y: vec3f, z: vec3f) -> mat3x3f {
    let inv = 1.0 / reference.dx;
    return mat3x3f(inv * x, inv * y, inv * z);
}
fn deformed(g: mat3x3f) -> mat3x3f {
    return mat3x3f(vec3f(1.0, 0.0, 0.0) + g[0], vec3f(0.0, 1.0, 0.0) + g[1], vec3f(0.0, 0.0, 1.0) + g[2]);
}

//! member 3 of fn (f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f = vec3f(0.0)
// A push at a point: acceleration a [m/s²] around b [m], falling off as a Gaussian of standard deviation p0 [m].

fn field_point(f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f {
    let d = x - f.b.xyz;
    return f.a.xyz * exp(-dot(d, d) / (2.0 * f.p0 * f.p0));
}

//! member 1 of fn (f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f = vec3f(0.0)
// The same acceleration everywhere: a [m/s²].

fn field_uniform(f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f {
    return f.a.xyz;
}

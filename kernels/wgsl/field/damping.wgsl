//! member 5 of fn (f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f = vec3f(0.0)
// Linear drag of each component of the velocity on its own: rates a [1/s].

fn field_damping(f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f {
    return -f.a.xyz * v;
}

//! use lib/texel lib/field lib/particle
// Gravity and the force fields, summed at a place.

// Every kernel that uses this binds `forces` as texels.
struct Forces {
    count: u32,         // of the fields in use
    d: array<Field, 16>,
}

fn load_field(i: u32) -> Field {
    let at = 1u + 6u * i;
    let kinds = textureLoad(forces, at, 0);
    let times = bitcast<vec4f>(kinds);
    let p = texel(forces, at + 1u);
    return Field(kinds.x, kinds.y, times.z, times.w, p.x, p.y, p.z, p.w, texel(forces, at + 2u), texel(forces, at + 3u),
        texel(forces, at + 4u), texel(forces, at + 5u));
}

// Acceleration of a body's gravity and of the fields that act on it, at x moving at v [m/s²].
fn acceleration(fields: u32, gravity: vec3f, count: u32, x: vec3f, v: vec3f, t: f32) -> vec3f {
    var a = gravity;
    for (var i = 0u; i < count; i++) {
        if (((fields >> i) & 1u) != 0u) { a += field_acceleration(load_field(i), x, v, t); }
    }
    return a;
}

//! use lib/field lib/particle lib/texel
// Gravity and the fields of a scene, as acceleration.

// Every kernel that uses this binds `forces` as texels.
struct Forces {
    gravity: vec4f,     // [m/s²]
    count: u32,         // of the fields in use
    d: array<Field, 16>,
}

fn load_field(i: u32) -> Field {
    let at = 2u + 6u * i;
    let kinds = textureLoad(forces, at, 0);
    let times = bitcast<vec4f>(kinds);
    let p = texel(forces, at + 1u);
    return Field(kinds.x, kinds.y, times.z, times.w, p.x, p.y, p.z, p.w, texel(forces, at + 2u), texel(forces, at + 3u),
        texel(forces, at + 4u), texel(forces, at + 5u));
}

// Acceleration of the fields that act on a body, and gravity [m/s²].
fn body_acceleration(p: Particle, fields: u32, gravity: vec3f, count: u32, t: f32) -> vec3f {
    // A body whose weight is carried from the start feels no gravity beyond it.
    var a = select(gravity, vec3f(0.0), (fields & CARRIED) != 0u);
    for (var i = 0u; i < count; i++) {
        if (((fields >> i) & 1u) != 0u) { a += field_acceleration(load_field(i), p.x, p.v, t); }
    }
    return a;
}

//! member 1 of fn (c: Collider, r: vec3f, side: u32) -> vec4f = vec4f(0.0, 0.0, 1.0, 1.0)
// Half space below the plane through the centre with normal `size`. A shape returns its outward normal and the
// signed distance of r, given relative to its centre in its own axes; `side` tells a room's walls apart.

fn shape_plane(c: Collider, r: vec3f, side: u32) -> vec4f {
    return vec4f(c.size.xyz, dot(r, c.size.xyz));
}

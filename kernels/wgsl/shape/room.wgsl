//! member 4 of fn (c: Collider, r: vec3f, side: u32) -> vec4f = vec4f(0.0, 0.0, 1.0, 1.0)
// Everything outside the box of half extents `size`; normals point into the room. The walls across x, y and z are three
// sides: who is behind two of them, in a corner, meets both.

fn shape_room(c: Collider, r: vec3f, side: u32) -> vec4f {
    let q = c.size.xyz - abs(r);
    let n = select(vec3f(1.0), vec3f(-1.0), r >= vec3f(0.0));
    if (side == 0u) { return vec4f(n.x, 0.0, 0.0, q.x); }
    if (side == 1u) { return vec4f(0.0, n.y, 0.0, q.y); }
    return vec4f(0.0, 0.0, n.z, q.z);
}

//! member 4 of fn (c: Collider, r: vec3f) -> vec4f = vec4f(0.0, 0.0, 1.0, 1.0)
// Everything outside the box of half extents `size`; normals point into the room.

fn shape_room(c: Collider, r: vec3f) -> vec4f {
    let q = c.size.xyz - abs(r);
    let side = select(vec3f(1.0), vec3f(-1.0), r >= vec3f(0.0));
    if (q.x <= q.y && q.x <= q.z) { return vec4f(side.x, 0.0, 0.0, q.x); }
    if (q.y <= q.z) { return vec4f(0.0, side.y, 0.0, q.y); }
    return vec4f(0.0, 0.0, side.z, q.z);
}

//! member 3 of fn (c: Collider, r: vec3f, side: u32) -> vec4f = vec4f(0.0, 0.0, 1.0, 1.0)
// Box of half extents `size`; inside, the normal is that of the nearest face.

fn shape_box(c: Collider, r: vec3f, side: u32) -> vec4f {
    let q = abs(r) - c.size.xyz;
    let outside = max(q, vec3f(0.0));
    let d = length(outside);
    let out = select(vec3f(-1.0), vec3f(1.0), r >= vec3f(0.0));
    if (d > 0.0) { return vec4f(out * outside / d, d); }
    if (q.x >= q.y && q.x >= q.z) { return vec4f(out.x, 0.0, 0.0, q.x); }
    if (q.y >= q.z) { return vec4f(0.0, out.y, 0.0, q.y); }
    return vec4f(0.0, 0.0, out.z, q.z);
}

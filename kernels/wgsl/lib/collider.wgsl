//! family shape
// Obstacles with prescribed motion, met on the grid: sticking, or separating with Coulomb friction.

struct Collider {
    shape: u32,         // member of the family `shape`
    sticky: u32,
    friction: f32,
    start: f32,         // [s] of the motion
    end: f32,
    p0: f32,
    center: vec4f,      // [m] at the start
    size: vec4f,        // half extents, or radius in x, or normal
    velocity: vec4f,    // [m/s]
    spin: vec4f,        // angular velocity [rad/s]
}

// Every kernel that uses this binds `colliders` as texels.
struct Colliders { count: u32, d: array<Collider, 16> }

fn load_collider(i: u32) -> Collider {
    let at = 1u + 6u * i;
    let kinds = textureLoad(colliders, at, 0);
    let times = bitcast<vec4f>(kinds);
    let p = texel(colliders, at + 1u);
    return Collider(kinds.x, kinds.y, times.z, times.w, p.x, p.y, texel(colliders, at + 2u), texel(colliders, at + 3u),
        texel(colliders, at + 4u), texel(colliders, at + 5u));
}

// Rotates v by `angle` about the unit axis (Rodrigues).
fn rotate(v: vec3f, axis: vec3f, angle: f32) -> vec3f {
    return v * cos(angle) + cross(axis, v) * sin(angle) + axis * dot(axis, v) * (1.0 - cos(angle));
}

// Sides of a collider that are met one after the other.
fn sides(c: Collider) -> u32 {
    return select(1u, 3u, SHAPE_ROOM_USED && c.shape == SHAPE_ROOM);
}

// Signed distance of x from collider c at time t [m].
fn gap(c: Collider, x: vec3f, t: f32) -> f32 {
    let moving = clamp(t, c.start, c.end) - c.start;
    let rate = length(c.spin.xyz);
    let axis = select(vec3f(0.0, 0.0, 1.0), c.spin.xyz / max(rate, 1e-20), rate > 0.0);
    let r = rotate(x - (c.center.xyz + c.velocity.xyz * moving), axis, -rate * moving);
    var least = shape(c.shape, c, r, 0u).w;
    for (var side = 1u; side < sides(c); side++) { least = min(least, shape(c.shape, c, r, side).w); }
    return least;
}

// Velocity of collider c at x at time t [m/s].
fn obstacle_velocity(c: Collider, x: vec3f, t: f32) -> vec3f {
    let r = x - (c.center.xyz + c.velocity.xyz * (clamp(t, c.start, c.end) - c.start));
    return select(vec3f(0.0), c.velocity.xyz + cross(c.spin.xyz, r), t >= c.start && t < c.end);
}

// Velocity v at node x, nearer to collider c than `reach` or inside it, after contact with it at time t.
fn collide(c: Collider, x: vec3f, v: vec3f, t: f32, reach: f32) -> vec3f {
    let moving = clamp(t, c.start, c.end) - c.start;
    let r = x - (c.center.xyz + c.velocity.xyz * moving);
    let rate = length(c.spin.xyz);
    let axis = select(vec3f(0.0, 0.0, 1.0), c.spin.xyz / max(rate, 1e-20), rate > 0.0);
    let own = rotate(r, axis, -rate * moving);
    let body = obstacle_velocity(c, x, t);
    var relative = v - body;
    var met = false;
    for (var side = 0u; side < sides(c); side++) {
        let hit = shape(c.shape, c, own, side);
        if (hit.w >= reach) { continue; }
        if (c.sticky != 0u) { return body; }
        let n = rotate(hit.xyz, axis, rate * moving);
        let vn = dot(relative, n);
        if (vn >= 0.0) { continue; }
        let vt = relative - vn * n;
        relative = vt * max(0.0, 1.0 + c.friction * vn / max(length(vt), 1e-20));
        met = true;
    }
    return select(v, body + relative, met);
}

//! use lib/collider lib/reference
// Compliant contact of points at the surface: what they meet, and how much of their surface faces it.

// An obstacle as a point near it sees it.
struct Facing {
    n: vec3f,       // outward normal
    gap: f32,       // [m]
    v: vec3f,       // velocity of the obstacle there [m/s]
}

// Where an obstacle has moved to.
struct Pose { center: vec3f, axis: vec3f, angle: f32 }

fn pose(c: Collider, t: f32) -> Pose {
    let moving = clamp(t, c.start, c.end) - c.start;
    let rate = length(c.spin.xyz);
    let axis = select(vec3f(0.0, 0.0, 1.0), c.spin.xyz / max(rate, 1e-20), rate > 0.0);
    return Pose(c.center.xyz + c.velocity.xyz * moving, axis, rate * moving);
}

// A place on the obstacle, from the world to its own axes and back.
fn to_own(p: Pose, x: vec3f) -> vec3f { return rotate(x - p.center, p.axis, -p.angle); }
fn to_world(p: Pose, r: vec3f) -> vec3f { return p.center + rotate(r, p.axis, p.angle); }

// Side `side` of an obstacle.
fn facing(c: Collider, p: Pose, x: vec3f, t: f32, side: u32) -> Facing {
    let hit = shape(c.shape, c, to_own(p, x), side);
    let running = t >= c.start && t < c.end;
    let v = select(vec3f(0.0), c.velocity.xyz + cross(c.spin.xyz, x - p.center), running);
    return Facing(rotate(hit.xyz, p.axis, p.angle), hit.w, v);
}

// The face of a point along one axis that looks against n: its area across n, and which way it looks; c is the axis's
// column of the cofactor, which turns areas as they are deformed, face an area at rest. A stretched face counts as it was
// at rest: its mass has not grown, and the step would not stand a stiffness that has. One that is turned or pressed counts
// as s (2 − s) of it, without a slope at s = 1: a pressure on an area that changes as it is pressed has no potential, and
// makes energy.
struct Face { area: f32, way: f32 }

fn face_against(tag: u32, axis: u32, c: vec3f, n: vec3f, face: f32) -> Face {
    let s = dot(c, n);
    let missing = ((tag >> select(11u + axis, 8u + axis, s > 0.0)) & 1u) != 0u;
    let most = min(abs(s), 1.0);
    return Face(select(0.0, face * most * (2.0 - most), missing), select(1.0, -1.0, s > 0.0));
}

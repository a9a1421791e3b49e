//! use lib/collider lib/sph_kernel
//! family shape
// Obstacles as volume that a fluid's sums see, in closed form (as density maps do by tables, Koschier & Bender 2017):
// behind a surface lies the fluid's mirror image, in layers. A surface is a plane where it is nearest; a room is six of
// them, and its corners multiply what they leave free. Force and fill belong to one energy: nothing gains from a wall.

// Number in the family `shape`.

// What walls do to a particle, summed up one surface after another.
struct Walls {
    free: f32,          // 1 − their part of s
    loose: f32,         // 1 − the part of those that stick
    slope: vec3f,       // ∇ of their part [1/m]
    drift: f32,         // Σ of their velocities times that [1/s]
    lift: vec3f,        // acceleration by the weight of the fluid they stand for [m/s²]
    slide: vec3f,       // Σ of their velocities times the size of their slope
    friction: f32,      // Σ of their coefficients times that
    weight: f32,        // Σ of that
    drag: f32,          // viscous drag of those that stick over ν [1/m²]
    squeeze: vec3f,     // Σ of the others' normals times what they take of a velocity along them, over ν [1/m²]
    power: f32,         // Σ of their velocities times `lift` [W/kg]
}

// Velocity of a wall, its outward normal, what of it sticks and rubs.
struct Surface { speed: vec3f, normal: vec3f, sticky: bool, friction: f32 }

// One surface at distance d (in h).
fn meet(m: Walls, s: Surface, d: f32, drive: vec3f, h: f32) -> Walls {
    let share = mirrored(d);
    let slope = s.normal * (mirrored_slope(d) / h);
    var o = m;
    let free = max(1.0 - share, 0.0);
    o.slope = m.slope * free + slope * m.free;
    o.drift = m.drift * free + dot(s.speed, slope) * m.free;
    o.free = m.free * free;
    o.loose = m.loose * select(1.0, free, s.sticky);
    let size = length(slope);
    // The fluid that the wall stands for has weight too: its pressure rises with depth (Adami 2012), and carries what
    // lies along the wall. Nothing hangs from a wall above it.
    let across = dot(drive, s.normal);
    let lift = s.normal * (min(across, 0.0) * mirrored_moment(d)) - share * (drive - across * s.normal);
    o.lift = m.lift * free + lift * m.free;
    o.power = m.power * free + dot(s.speed, lift) * m.free;
    // A sticking wall goes on with the fluid's shear, so that the velocity is the wall's at its surface; one that lets slip
    // turns what comes to it.
    let near = 1.0 / (max(d, 0.1) * h * h);
    if (s.sticky) { o.drag -= mirrored_slope(d) * near; } else { o.squeeze += s.normal * (mirrored_squeeze(d) * near); }
    o.slide += s.speed * size;
    o.friction += select(s.friction, 0.0, s.sticky) * size;
    o.weight += size;
    return o;
}

// Obstacle c at time t, on a particle at x that is driven by an acceleration.
fn meet_collider(m: Walls, c: Collider, x: vec3f, t: f32, drive: vec3f, h: f32) -> Walls {
    let moving = clamp(t, c.start, c.end) - c.start;
    let from_center = x - (c.center.xyz + c.velocity.xyz * moving);
    let rate = length(c.spin.xyz);
    let axis = select(vec3f(0.0, 0.0, 1.0), c.spin.xyz / max(rate, 1e-20), rate > 0.0);
    let r = rotate(from_center, axis, -rate * moving);
    var hit = shape(c.shape, c, r, 0u);
    for (var side = 1u; side < sides(c); side++) {
        let other = shape(c.shape, c, r, side);
        if (other.w < hit.w) { hit = other; }
    }
    let d = hit.w / h;
    if (d >= 1.0) { return m; }
    let running = t >= c.start && t < c.end;
    var s = Surface(select(vec3f(0.0), c.velocity.xyz + cross(c.spin.xyz, from_center), running),
        rotate(hit.xyz, axis, rate * moving), c.sticky != 0u, c.friction);
    if (d >= 0.0 && c.shape == SHAPE_ROOM) {
        var o = m;
        for (var a = 0u; a < 3u; a++) {
            let e = select(vec3f(0.0), vec3f(1.0), vec3u(a) == vec3u(0u, 1u, 2u));
            let at = dot(e, r);
            let half = dot(e, c.size.xyz);
            s.normal = rotate(select(e, -e, at >= 0.0), axis, rate * moving);
            let near = (half - abs(at)) / h;
            if (near < 1.0) { o = meet(o, s, near, drive, h); }
        }
        return o;
    }
    return meet(m, s, d, drive, h);
}

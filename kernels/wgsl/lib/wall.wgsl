//! use lib/collider lib/sph_kernel
//! family shape
// Obstacles as volume that a fluid's sums see, in closed form (as density maps do by tables, Koschier & Bender 2017):
// behind a surface lies the fluid's mirror image, in layers. A surface is a plane where it is nearest; a room is six of
// them, and corners multiply what they leave free. Force and fill belong to one energy: nothing gains from a wall. Of
// surfaces that face the same way the nearest counts, so that those that coincide, or sweep over each other, count once.

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

// A surface near a particle: its velocity, outward normal and distance, what of it sticks and rubs.
struct Surface { speed: vec3f, sticky: bool, normal: vec3f, friction: f32, d: f32 }

// Those nearer than a particle's size; there is no room for more.
const MOST_NEAR: u32 = 8u;
struct Near {
    count: u32,
    deepest: f32,       // least distance
    d: array<Surface, MOST_NEAR>,
}

// Cosine of the angle between normals from which on surfaces begin to count as one. Where they do not face the same way, as in
// corners, each counts.
const ALIKE: f32 = 0.9;
// Of surfaces that do the nearest counts alone, and of those as near one each its share; over this difference of distance [h]
// one takes over from another that it sweeps over.
const BLUR: f32 = 0.1;
// By how much shares of walls that face each other grow with what the gap between lacks. As 1 they grow as they do with
// distance, and a particle that leaves the narrowest gap keeps its s. Where pressure is solved for nothing is stored that
// could be lost, and a particle by itself must not be asked to go: so it has s = 1 where there is no gap left.
fn grows() -> f32 { return select(1.0, 0.57, INCOMPRESSIBLE); }
// What is left free where a surface takes all.
const LEAST: f32 = 1e-3;

// How a surface is met among others.
struct Company {
    part: f32,          // of it that counts
    lacking: f32,       // by how much the gap between it and another that faces it is narrower than h [h]
    both: vec3f,        // −∇ of half of that, times h
    closing: f32,       // and of its growth with time, the walls' part [m/s]
}

// Surface k of those that are near. Two that face each other with less than h between have no room for a particle and its
// images, which would push it into one of them: they are met as if they were h apart, about the middle between them, and
// each of their shares grows by half of what is lacking, as it does there with distance. So what lies between is
// pressed out to the sides.
fn company(near: ptr<function, Near>, k: u32) -> Company {
    let own = (*near).d[k];
    var out = Company(1.0, 0.0, vec3f(0.0), 0.0);
    var crowd = 1.0;
    for (var j = 0u; j < (*near).count; j++) {
        if (j == k) { continue; }
        let other = (*near).d[j];
        let c = dot(own.normal, other.normal);
        let opposed = smoothstep(0.0, 1.0, -c);
        let lacking = opposed * (1.0 - own.d - other.d);
        if (lacking > out.lacking) {
            out.lacking = lacking;
            out.both = 0.5 * opposed * (own.normal + other.normal);
            out.closing = 0.5 * opposed * (dot(own.speed, own.normal) + dot(other.speed, other.normal));
        }
        let alike = smoothstep(ALIKE, 1.0, c);
        if (alike > 0.0) { crowd += alike * exp(clamp((own.d - other.d) / BLUR, -40.0, 40.0)); }
    }
    out.part = 1.0 / crowd;
    return out;
}

// One surface.
fn meet(m: Walls, s: Surface, beside: Company, drive: vec3f, h: f32) -> Walls {
    let d = s.d + 0.5 * beside.lacking;
    let share = mirrored(d) + 0.5 * grows() * beside.lacking;
    let steep = mirrored_slope(d);
    let slope = (steep * s.normal - (grows() + steep) * beside.both) / h;
    let drift = (steep * dot(s.speed, s.normal) - (grows() + steep) * beside.closing) / h;
    var o = m;
    // Powers, so that parts of surfaces that coincide multiply to one surface.
    let left = max(1.0 - share, LEAST);
    let free = select(pow(left, beside.part), left, beside.part == 1.0);
    let counts = beside.part * free / left;
    o.slope = m.slope * free + slope * (counts * m.free);
    o.drift = m.drift * free + drift * (counts * m.free);
    o.free = m.free * free;
    o.loose = m.loose * select(1.0, free, s.sticky);
    let size = beside.part * length(slope);
    // The fluid that the wall stands for has weight too: its pressure rises with depth (Adami 2012), and carries what
    // lies along the wall. Nothing hangs from a wall above it.
    let across = dot(drive, s.normal);
    let lift = counts * (s.normal * (min(across, 0.0) * mirrored_moment(d)) - share * (drive - across * s.normal));
    o.lift = m.lift * free + lift * m.free;
    o.power = m.power * free + dot(s.speed, lift) * m.free;
    // A sticking wall goes on with the fluid's shear, so that the velocity is the wall's at its surface; one that lets slip
    // turns what comes to it.
    let near = beside.part / (max(d, 0.1) * h * h);
    if (s.sticky) { o.drag -= steep * near; } else { o.squeeze += s.normal * (mirrored_squeeze(d) * near); }
    o.slide += s.speed * size;
    o.friction += select(s.friction, 0.0, s.sticky) * size;
    o.weight += size;
    return o;
}

// All of them, on a particle that is driven by an acceleration.
fn meet_all(near: ptr<function, Near>, drive: vec3f, h: f32) -> Walls {
    var m: Walls;
    m.free = 1.0;
    m.loose = 1.0;
    for (var k = 0u; k < (*near).count; k++) { m = meet(m, (*near).d[k], company(near, k), drive, h); }
    return m;
}

fn note(near: ptr<function, Near>, s: Surface) {
    let at = (*near).count;
    if (s.d >= 1.0 || at == MOST_NEAR) { return; }
    (*near).d[at] = s;
    (*near).count = at + 1u;
}

// Looks for surfaces of obstacle c near x at time t.
fn look(near: ptr<function, Near>, c: Collider, x: vec3f, t: f32, h: f32) {
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
    if (d >= 1.0) { return; }
    (*near).deepest = min((*near).deepest, d);
    let running = t >= c.start && t < c.end;
    var s = Surface(select(vec3f(0.0), c.velocity.xyz + cross(c.spin.xyz, from_center), running), c.sticky != 0u,
        rotate(hit.xyz, axis, rate * moving), c.friction, d);
    if (d < 0.0 || c.shape != SHAPE_ROOM) {
        note(near, s);
        return;
    }
    // Across each axis the nearer wall, and in a narrow room the other.
    let walls = select(3u, 6u, any(c.size.xyz < vec3f(h)));
    for (var a = 0u; a < walls; a++) {
        let axial = select(vec3f(0.0), vec3f(1.0), vec3u(a % 3u) == vec3u(0u, 1u, 2u));
        let e = select(axial, -axial, (dot(axial, r) >= 0.0) == (a < 3u));
        s.normal = rotate(e, axis, rate * moving);
        s.d = (dot(axial, c.size.xyz) + dot(e, r)) / h;
        note(near, s);
    }
}

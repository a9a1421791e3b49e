//! family field
// Force fields: the schedule and region common to all; each kind is a member of the family `field`.

struct Field {
    kind: u32,          // member of the family
    region: u32,        // 0 everywhere, 1 box, 2 ball
    start: f32,         // [s]
    end: f32,
    ramp: f32,          // [s] of smooth rise and fall
    p0: f32,            // parameters of the member
    p1: f32,
    p2: f32,
    a: vec4f,           // vectors of the member
    b: vec4f,
    region_min: vec4f,  // box corner, or centre of the ball
    region_max: vec4f,  // box corner, or radius in x
}

fn field_share(f: Field, x: vec3f, t: f32) -> f32 {
    if (t < f.start || t >= f.end) { return 0.0; }
    if (f.region == 1u && (any(x < f.region_min.xyz) || any(x > f.region_max.xyz))) { return 0.0; }
    if (f.region == 2u && distance(x, f.region_min.xyz) > f.region_max.x) { return 0.0; }
    if (f.ramp <= 0.0) { return 1.0; }
    return smoothstep(0.0, f.ramp, t - f.start) * smoothstep(0.0, f.ramp, f.end - t);
}

// Acceleration of field f on material at x moving at v [m/s²].
fn field_acceleration(f: Field, x: vec3f, v: vec3f, t: f32) -> vec3f {
    let share = field_share(f, x, t);
    if (share <= 0.0) { return vec3f(0.0); }
    return share * field(f.kind, f, x, v, t);
}

// What ties display points to particles.

// The particles that carry a point.
struct Carrier {
    particle: vec4u,
    weight: vec4f,      // all zero: nothing carries the point, it stays where it is
}

// A particle when points were bound to it.
struct Bound {
    x: vec4f,           // [m]
    // Rows of the inverse of F.
    i0: vec4f,
    i1: vec4f,
    i2: vec4f,
}

// Constants of a call.
struct Carried {
    count: u32,         // particles to remember, or points to carry
}

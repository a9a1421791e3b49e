//! use lib/reference
// The surface with which bodies on grids of their own meet each other. A facet is a face of a point that has no
// neighbour there. Those of a body fill whole groups of 64, the last of them with facets that are none.

const FACETS: u32 = 64u;
const NO_FACET: u32 = 0x80000000u;
// Two facets meet no deeper than in the step before, the way they have come since then, and so much more, in cells: what
// lies deeper are the backs of two bodies or rims that are pressed flat. In the first step they may be as deep as FIRST.
const NEAR: f32 = 0.05;
const FIRST: f32 = 0.5;
const SHEET: u32 = 0x800u;      // the other side of its point lies bare as well

// At rest.
struct Facet {
    x: vec3f,           // its middle [m]
    point: u32,         // cell · 8 + corner of the point behind it; NOBODY where that is held
    normal: vec3f,      // of the smooth surface, outward
    tag: u32,           // body; in bits 8–9 its axis, in bit 10 whether it looks up along it; SHEET, NO_FACET
    stiffness: f32,     // of contact: pressure for a depth [Pa/m]
    friction: f32,      // Coulomb's coefficient
    push: u32,          // its place among `pushes`, see `contact`
    room: f32,          // share of a full grid that the body itself leaves there, smoothed twice
}

// Now.
struct Patch {
    x: vec3f,           // its middle [m]
    tag: u32,
    normal: vec3f,      // turned
    stiffness: f32,
    area: vec3f,        // outward, as long as the face is large [m²]
    friction: f32,
    slid: vec3f,        // its part of how far a pair has slid [m]
    push: u32,
    v: vec3f,           // its velocity [m/s]
    dense: f32,         // √ of the density at rest
    reach: f32,         // how deep what it meets may be [m]
    wave: f32,          // fastest elastic wave [m/s]
    damping: f32,       // β [s], see `Solid`
    spare: u32,
}

// What it keeps from step to step.
struct Tie {
    slip: vec3f,        // how far it has slid against what it touches and not let go [m]
    energy: f32,        // its half of the springs' [J]
    x: vec3f,           // where it was [m]
    reach: f32,         // how deep what it meets next may be [m]; 0 before the first step
}

// What it keeps of the grid's matter from step to step.
struct Touch {
    force: vec3f,       // on the body [N]
    energy: f32,        // work that its pressure has taken and not given back [J]
    slip: vec3f,        // how far it has slid against what it touches and not let go [m]
    dt: f32,            // its last step [s]
}

// Of a group.
struct Bounds {
    low: vec3f,         // [m]
    body: u32,
    high: vec3f,
    spare: u32,
    slowest: vec3f,     // of the velocities, along each axis [m/s]
    spare2: u32,
    fastest: vec3f,
    spare3: u32,
}

// Sizes of a call.
struct Surface {
    dx: f32,            // [m]
    facets: u32,        // in whole groups
}

fn load_patch(t: texture_1d<u32>, i: u32) -> Patch {
    let a = texel(t, 6u * i);
    let b = texel(t, 6u * i + 1u);
    let c = texel(t, 6u * i + 2u);
    let d = texel(t, 6u * i + 3u);
    let e = texel(t, 6u * i + 4u);
    let f = texel(t, 6u * i + 5u);
    return Patch(a.xyz, bitcast<u32>(a.w), b.xyz, b.w, c.xyz, c.w, d.xyz, bitcast<u32>(d.w), e.xyz, e.w,
        f.x, f.y, f.z, 0u);
}

// Material points. What P2G reads is in one struct of six vec4, what only G2P needs is in another.

struct Particle {
    x: vec3f,       // [m]
    tag: u32,       // body, and the flags below
    v: vec3f,       // [m/s]
    m: f32,         // [kg]
    // Rows of the affine velocity C [1/s] (Jiang 2015) in xyz; in w the diagonal of V0 τ [J], τ the Kirchhoff stress.
    c0: vec4f,
    c1: vec4f,
    c2: vec4f,
    // V0 τ off the diagonal: xy, xz, yz [J]; w is free.
    s: vec4f,
}

// Columns of the deformation gradient F in xyz: the elastic part of it where a material flows, and J alone, in f0.x,
// where it is a liquid. f0.w is the volume at rest V0 [m³], f1.w what else the material remembers, 0 at the start.
struct Deformation {
    f0: vec4f,
    f1: vec4f,
    f2: vec4f,
}

const BODY_MASK: u32 = 0xffu;
const WATCHED: u32 = 0x02000000u;       // beside what is asleep, and to tell when motion comes
const LED: u32 = 0x04000000u;           // still in its nozzle, whatever pushes it (SPH)
// Not emitted yet, or no more; set together with QUARANTINED, and not counted as lost.
const DORMANT: u32 = 0x08000000u;
const ASLEEP: u32 = 0x10000000u;        // at rest: gives to the grid where its neighbours are awake, and takes nothing from it
const FLOWS: u32 = 0x20000000u;         // of a material whose F forgets: what is drawn does not follow it
const PINNED: u32 = 0x40000000u;        // held where it is
const QUARANTINED: u32 = 0x80000000u;   // taken out of the simulation: not finite, or outside the grid
// A pinned particle weighs this many times its mass on the grid, which holds the nodes it touches.
const PIN_MASS: f32 = 1e6;

struct Body {
    material: u32,      // kind of material
    fields: u32,        // bit i: field i acts on this body
    mu: f32,            // shear modulus [Pa]
    lambda: f32,        // Lamé's first parameter, or the bulk modulus of a liquid [Pa]
    p: vec4f,           // parameters of the material's own
    gravity: vec3f,     // [m/s²]; zero where the body's weight is carried from the start (prestress)
    wave: f32,          // speed that limits the step at rest: of the fastest wave, and of viscosity across a cell [m/s]
}

// What a material is asked: the deformation it would have if all of the step were elastic.
struct Trial {
    f: mat3x3f,
    memory: f32,        // what the material remembers (Deformation.f1.w)
    gradient: mat3x3f,  // of the velocity [1/s]; columns are derivatives along x, y, z
}

// And what it answers.
struct Response {
    tau: mat3x3f,       // Kirchhoff stress P Fᵀ [Pa]
    f: mat3x3f,         // the elastic deformation that is left
    memory: f32,
    energy: f32,        // per volume at rest [J/m³]
    wave: f32,          // how much faster waves are than at rest
}

// The answer where there is no such material.
fn inert(t: Trial) -> Response {
    return Response(mat3x3f(), t.f, t.memory, 0.0, 1.0);
}

fn diagonal(d: vec3f) -> mat3x3f {
    return mat3x3f(d.x, 0.0, 0.0, 0.0, d.y, 0.0, 0.0, 0.0, d.z);
}

fn finite(v: vec3f) -> bool {
    // Compilers may assume there is no NaN, so the test is on bits: exponent all ones.
    let e = bitcast<vec3u>(v) & vec3u(0x7f800000u);
    return all(e != vec3u(0x7f800000u));
}

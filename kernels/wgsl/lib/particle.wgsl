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

// Columns of the deformation gradient F in xyz; f0.w is the volume at rest V0 [m³].
struct Deformation {
    f0: vec4f,
    f1: vec4f,
    f2: vec4f,
}

const BODY_MASK: u32 = 0xffu;
const PINNED: u32 = 0x40000000u;        // held where it is
const QUARANTINED: u32 = 0x80000000u;   // taken out of the simulation: not finite, or outside the grid
// A pinned particle weighs this many times its mass on the grid, which holds the nodes it touches.
const PIN_MASS: f32 = 1e6;

// Bit of `fields`: the body's weight is carried from the start (prestress).
const CARRIED: u32 = 0x80000000u;

struct Body {
    material: u32,      // kind of material
    fields: u32,        // bit i: field i acts on this body
    mu: f32,            // shear modulus [Pa]
    lambda: f32,        // Lamé's first parameter [Pa]
}

struct Stress {
    tau: mat3x3f,       // Kirchhoff stress P Fᵀ [Pa]
    energy: f32,        // per volume at rest [J/m³]
}

fn finite(v: vec3f) -> bool {
    // Compilers may assume there is no NaN, so the test is on bits: exponent all ones.
    let e = bitcast<vec3u>(v) & vec3u(0x7f800000u);
    return all(e != vec3u(0x7f800000u));
}

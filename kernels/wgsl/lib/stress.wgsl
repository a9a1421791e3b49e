//! use lib/particle
//! family material
// Stress of a particle from its deformation, by its body's material.

override PRESTRESS: bool = false;

// Second Piola–Kirchhoff stress at the start, off-diagonal part in b [J].
struct Prestress {
    a: vec4f,   // V0 S: xx, yy, zz
    b: vec4f,   // V0 S: xy, xz, yz
}

// Stores V0 τ, with the prestress carried along by F.
fn store_stress(p: ptr<function, Particle>, b: Body, f: mat3x3f, volume: f32, s0: Prestress) {
    var tau = volume * material(b.material, b, f).tau;
    if (PRESTRESS) {
        let s = mat3x3f(vec3f(s0.a.x, s0.b.x, s0.b.y), vec3f(s0.b.x, s0.a.y, s0.b.z), vec3f(s0.b.y, s0.b.z, s0.a.z));
        tau += f * s * transpose(f);
    }
    (*p).c0.w = tau[0].x;
    (*p).c1.w = tau[1].y;
    (*p).c2.w = tau[2].z;
    (*p).s = vec4f(tau[1].x, tau[2].x, tau[2].y, 0.0);
}

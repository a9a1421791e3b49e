//! use lib/clock lib/particle
//! family material
// Stress of every particle from its deformation: before the first substep, and after a change of state.

struct Particles { d: array<Particle> }
struct Deformations { d: array<Deformation> }
struct Bodies { d: array<Body> }
@group(0) @binding(0) var<storage, read_write> particles: Particles;
@group(0) @binding(1) var<storage, read> deformations: Deformations;
@group(0) @binding(2) var<storage, read> bodies: Bodies;
@group(0) @binding(3) var<storage, read> clock: Clock;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= clock.particles) { return; }
    let d = deformations.d[id.x];
    let body = bodies.d[particles.d[id.x].tag & BODY_MASK];
    let trial = Trial(mat3x3f(d.f0.xyz, d.f1.xyz, d.f2.xyz), d.f1.w, mat3x3f());
    let tau = d.f0.w * material(body.material, body, trial).tau;
    particles.d[id.x].c0.w = tau[0].x;
    particles.d[id.x].c1.w = tau[1].y;
    particles.d[id.x].c2.w = tau[2].z;
    particles.d[id.x].s = vec4f(tau[1].x, tau[2].x, tau[2].y, 0.0);
}

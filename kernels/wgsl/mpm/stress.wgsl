//! use lib/clock lib/stress
// Stress of every particle from its deformation: before the first substep, and after a change of state.

struct Particles { d: array<Particle> }
struct Deformations { d: array<Deformation> }
struct Bodies { d: array<Body> }
struct Prestresses { d: array<Prestress> }
@group(0) @binding(0) var<storage, read_write> particles: Particles;
@group(0) @binding(1) var<storage, read> deformations: Deformations;
@group(0) @binding(2) var<storage, read> prestress: Prestresses;
@group(0) @binding(3) var<storage, read> bodies: Bodies;
@group(0) @binding(4) var<storage, read> clock: Clock;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= clock.particles) { return; }
    var p = particles.d[id.x];
    let d = deformations.d[id.x];
    var initial: Prestress;
    if (PRESTRESS) { initial = prestress.d[id.x]; }
    store_stress(&p, bodies.d[p.tag & BODY_MASK], mat3x3f(d.f0.xyz, d.f1.xyz, d.f2.xyz), d.f0.w, initial);
    particles.d[id.x] = p;
}

//! use lib/clock lib/stress
// Keeps the stress that a body at rest under a small load carries, scaled up to the full load, as its prestress.
// The scaled stress balances gravity exactly where the particles stand, so the shape given is the sagged one.

struct Particles { d: array<Particle> }
struct Prestresses { d: array<Prestress> }
@group(0) @binding(0) var<storage, read> particles: Particles;
@group(0) @binding(1) var<storage, read_write> prestress: Prestresses;
@group(0) @binding(2) var<storage, read> clock: Clock;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= clock.particles) { return; }
    let p = particles.d[id.x];
    let scale = 1.0 / clock.load;
    prestress.d[id.x] = Prestress(scale * vec4f(p.c0.w, p.c1.w, p.c2.w, 0.0), scale * vec4f(p.s.xyz, 0.0));
}

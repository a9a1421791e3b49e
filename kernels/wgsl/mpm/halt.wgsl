//! use lib/clock lib/particle
// Takes all motion out of the particles: the step of kinetic damping (Cundall 1987) at a peak of kinetic energy.

struct Particles { d: array<Particle> }
@group(0) @binding(0) var<storage, read_write> particles: Particles;
@group(0) @binding(1) var<storage, read> clock: Clock;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= clock.particles) { return; }
    particles.d[id.x].v = vec3f(0.0);
    particles.d[id.x].c0 = vec4f(0.0, 0.0, 0.0, particles.d[id.x].c0.w);
    particles.d[id.x].c1 = vec4f(0.0, 0.0, 0.0, particles.d[id.x].c1.w);
    particles.d[id.x].c2 = vec4f(0.0, 0.0, 0.0, particles.d[id.x].c2.w);
}

//! use lib/particle lib/carrier
// Remembers where particles are and how they are deformed, so that points bound to them now can be carried later.

struct Particles { d: array<Particle> }
struct Deformations { d: array<Deformation> }
struct Bounds { d: array<Bound> }
@group(0) @binding(0) var<storage, read> particles: Particles;
@group(0) @binding(1) var<storage, read> deformations: Deformations;
@group(0) @binding(2) var<storage, read_write> bound: Bounds;
var<immediate> call: Carried;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= call.count) { return; }
    let f = deformations.d[i];
    let a = f.f0.xyz;
    let b = f.f1.xyz;
    let c = f.f2.xyz;
    let volume = dot(a, cross(b, c));
    var r = Bound(vec4f(particles.d[i].x, 0.0), vec4f(1.0, 0.0, 0.0, 0.0), vec4f(0.0, 1.0, 0.0, 0.0), vec4f(0.0, 0.0, 1.0, 0.0));
    // A flattened particle has no inverse; its points then follow F itself.
    if (abs(volume) > 1e-6) {
        r.i0 = vec4f(cross(b, c) / volume, 0.0);
        r.i1 = vec4f(cross(c, a) / volume, 0.0);
        r.i2 = vec4f(cross(a, b) / volume, 0.0);
    }
    bound.d[i] = r;
}

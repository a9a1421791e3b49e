//! use lib/reference lib/polar
// Particles from the nodes, for whoever draws, writes or sums: place, velocity, its gradient and the deformation. What
// is held keeps its place. One lane a particle.
//! texels cells: ElasticCell
//! texels u: vec4f
//! texels v: vec4f
//! texels rests: Rest

struct Particles { d: array<Particle> }
struct Deformations { d: array<Deformation> }
@group(0) @binding(0) var cells: texture_1d<u32>;
@group(0) @binding(1) var u: texture_1d<u32>;
@group(0) @binding(2) var v: texture_1d<u32>;
@group(0) @binding(3) var rests: texture_1d<u32>;
@group(0) @binding(4) var<storage, read_write> particles: Particles;
@group(0) @binding(5) var<storage, read_write> deformations: Deformations;
var<immediate> reference: Reference;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {
    let p = id.x + id.y * groups.x * 64u;
    if (p >= reference.points) { return; }
    let rest = texel(rests, p);
    let point = bitcast<u32>(rest.w);
    if (point == NOBODY) { return; }
    let inv = 1.0 / reference.dx;
    let moved = sum_at(cells, u, point);
    let moving = sum_at(cells, v, point);
    let f = mat3x3f(vec3f(1.0, 0.0, 0.0) + inv * moved.x, vec3f(0.0, 1.0, 0.0) + inv * moved.y,
        vec3f(0.0, 0.0, 1.0) + inv * moved.z);
    let c = cofactor(f);
    let j = dot(f[0], c[0]);
    // ∇v = Ḟ F⁻¹ where F has an inverse.
    let rate = select(0.0, inv / j, abs(j) > 1e-6);
    let gradient = rate * (mat3x3f(moving.x, moving.y, moving.z) * transpose(c));
    let rows = transpose(gradient);
    particles.d[p].x = rest.xyz + moved.v;
    particles.d[p].v = moving.v;
    particles.d[p].c0 = vec4f(rows[0], 0.0);
    particles.d[p].c1 = vec4f(rows[1], 0.0);
    particles.d[p].c2 = vec4f(rows[2], 0.0);
    let volume = deformations.d[p].f0.w;
    deformations.d[p] = Deformation(vec4f(f[0], volume), vec4f(f[1], 0.0), vec4f(f[2], 0.0));
}

//! use lib/grid lib/particle lib/texel
// Puts the particles of some blocks to sleep and wakes others. What falls asleep stands still from then on: its stress
// goes on carrying its neighbours, and what little it moved adds up to nothing.
//! texels flags: u32

struct Particles { d: array<Particle> }
@group(0) @binding(0) var<storage, read_write> particles: Particles;
@group(0) @binding(1) var flags: texture_1d<u32>;       // of each block: ASLEEP, WATCHED or neither
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= grid.count) { return; }
    let p = particles.d[id.x];
    let base = base_node(grid, p.x);
    if ((p.tag & QUARANTINED) != 0u || !inside(grid, base)) { return; }
    let flag = word(flags, block_index(grid, vec3u(base) >> vec3u(2u)));
    particles.d[id.x].tag = (p.tag & ~(ASLEEP | WATCHED)) | flag;
    if ((flag & ASLEEP) == 0u || (p.tag & ASLEEP) != 0u) { return; }
    particles.d[id.x].v = vec3f(0.0);
    particles.d[id.x].c0 = vec4f(vec3f(0.0), p.c0.w);
    particles.d[id.x].c1 = vec4f(vec3f(0.0), p.c1.w);
    particles.d[id.x].c2 = vec4f(vec3f(0.0), p.c2.w);
}

//! use lib/claim lib/clock lib/grid lib/particle lib/texel
// Finds each particle's cell and claims its block. A particle that is not finite or has left the grid is
// quarantined.
//! texels was: Particle
//! texels claimed: u32
//! texels awake: u32

struct Particles { d: array<Particle> }
struct Words { d: array<u32> }
struct AtomicWords { d: array<atomic<u32>> }
@group(0) @binding(0) var<storage, read_write> particles: Particles;
@group(0) @binding(1) var<storage, read_write> keys: Words;
@group(0) @binding(2) var<storage, read_write> table: AtomicWords;
@group(0) @binding(3) var<storage, read_write> list: Words;
@group(0) @binding(4) var<storage, read_write> live: Live;
@group(0) @binding(5) var<storage, read_write> clock: Clock;
// The same particles and table, read.
@group(0) @binding(6) var was: texture_1d<u32>;
@group(0) @binding(7) var claimed: texture_1d<u32>;
@group(0) @binding(8) var awake: texture_1d<u32>;   // numbers of the particles that are worked on
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = group.x * 64u + lane;
    if (i >= clock.particles - clock.idle) { return; }
    let p = word(awake, i);
    let head = texel(was, 6u * p);
    let tag = bitcast<u32>(head.w);
    if ((tag & QUARANTINED) != 0u) {
        keys.d[p] = NOWHERE;
        return;
    }
    let v = texel(was, 6u * p + 1u).xyz;
    let key = cell_key(head.xyz, v);
    keys.d[p] = key;
    if (key == NOWHERE) {
        particles.d[p].tag = tag | QUARANTINED;
        atomicAdd(&clock.quarantined, 1u);
        if (finite(head.xyz) && finite(v)) { atomicAdd(&clock.left, 1u); }
        return;
    }
    claim(key >> 6u);
}

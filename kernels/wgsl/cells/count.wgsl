//! use lib/clock lib/grid lib/texel
// Counts the particles of each cell and gives each its place in the count.
//! texels keys: u32
//! texels table: u32
//! texels awake: u32

struct Words { d: array<u32> }
struct AtomicWords { d: array<atomic<u32>> }
@group(0) @binding(0) var keys: texture_1d<u32>;
@group(0) @binding(1) var table: texture_1d<u32>;
@group(0) @binding(2) var<storage, read_write> counts: AtomicWords;
@group(0) @binding(3) var<storage, read_write> ranks: Words;
@group(0) @binding(4) var<storage, read> clock: Clock;
@group(0) @binding(5) var awake: texture_1d<u32>;   // numbers of the particles that are worked on
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = group.x * 64u + lane;
    if (i >= clock.particles - clock.idle) { return; }
    let p = word(awake, i);
    let key = word(keys, p);
    if (key == NOWHERE) { return; }
    let slot = word(table, key >> 6u) - 1u;
    if (slot >= grid.capacity) { return; }
    ranks.d[p] = atomicAdd(&counts.d[slot * 64u + (key & 63u)], 1u);
}

//! use lib/clock lib/grid lib/texel
// Writes the particles' order: by block, then by cell.
//! texels keys: u32
//! texels table: u32
//! texels starts: u32
//! texels ranks: u32

struct Words { d: array<u32> }
@group(0) @binding(0) var keys: texture_1d<u32>;
@group(0) @binding(1) var table: texture_1d<u32>;
@group(0) @binding(2) var starts: texture_1d<u32>;
@group(0) @binding(3) var ranks: texture_1d<u32>;
@group(0) @binding(4) var<storage, read_write> order: Words;
@group(0) @binding(5) var<storage, read> clock: Clock;
@group(0) @binding(6) var<storage, read> awake: Words;      // groups of 64 particles of which any moves
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let p = awake.d[group.x] * 64u + lane;
    if (p >= clock.particles) { return; }
    let key = word(keys, p);
    if (key == NOWHERE) { return; }
    let slot = word(table, key >> 6u) - 1u;
    if (slot >= grid.capacity) { return; }
    order.d[word(starts, slot * 64u + (key & 63u)) + word(ranks, p)] = p;
}

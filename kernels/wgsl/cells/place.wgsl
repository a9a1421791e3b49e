//! use lib/clock lib/grid lib/texel
// Writes the particles' order: by block, then by cell. From here on a particle's key is that of its slot's cell.
//! texels was: u32
//! texels table: u32
//! texels starts: u32
//! texels ranks: u32
//! texels awake: u32

struct Words { d: array<u32> }
@group(0) @binding(0) var was: texture_1d<u32>;                 // the keys: block · 64 + cell
@group(0) @binding(1) var table: texture_1d<u32>;
@group(0) @binding(2) var starts: texture_1d<u32>;
@group(0) @binding(3) var ranks: texture_1d<u32>;
@group(0) @binding(4) var<storage, read_write> order: Words;
@group(0) @binding(5) var<storage, read> clock: Clock;
@group(0) @binding(6) var<storage, read_write> keys: Words;     // the same: slot · 64 + cell
@group(0) @binding(7) var awake: texture_1d<u32>;   // numbers of the particles that are worked on
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = group.x * 64u + lane;
    if (i >= clock.particles - clock.idle) { return; }
    let p = word(awake, i);
    let key = word(was, p);
    if (key == NOWHERE) { return; }
    let slot = word(table, key >> 6u) - 1u;
    if (slot >= grid.capacity) { return; }
    let cell = slot * 64u + (key & 63u);
    keys.d[p] = cell;
    order.d[word(starts, cell) + word(ranks, p)] = p;
}

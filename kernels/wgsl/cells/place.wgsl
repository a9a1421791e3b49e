//! use lib/clock lib/grid
// Writes the particles' order: by block, then by cell.

struct Words { d: array<u32> }
@group(0) @binding(0) var<storage, read> keys: Words;
@group(0) @binding(1) var<storage, read> table: Words;
@group(0) @binding(2) var<storage, read> starts: Words;
@group(0) @binding(3) var<storage, read> ranks: Words;
@group(0) @binding(4) var<storage, read_write> order: Words;
@group(0) @binding(5) var<storage, read> clock: Clock;
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let p = id.x;
    if (p >= clock.particles) { return; }
    let key = keys.d[p];
    if (key == NOWHERE) { return; }
    let slot = table.d[key >> 6u] - 1u;
    if (slot >= grid.capacity) { return; }
    order.d[starts.d[slot * 64u + (key & 63u)] + ranks.d[p]] = p;
}

//! use lib/grid
// The slots of the blocks around each slot: eight below (itself and its lower neighbours, x first, then y, then z),
// that hold particles and reach its nodes, eight above, whose nodes its particles reach, and which rows of those below
// hold particles.
// One workgroup a slot.

struct Words { d: array<u32> }
@group(0) @binding(0) var<storage, read> table: Words;
@group(0) @binding(1) var<storage, read> list: Words;
@group(0) @binding(2) var<storage, read_write> links: Words;     // 24 a slot; NOWHERE where there is no block
@group(0) @binding(3) var<storage, read> fills: Words;
@group(0) @binding(4) var<storage, read> live: Counts;
var<immediate> grid: Grid;

@compute @workgroup_size(16)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let d = vec3u(lane & 1u, (lane >> 1u) & 1u, (lane >> 2u) & 1u);
    // Below the lowest block the index wraps around, and is outside as well.
    let at = block_coord(grid, list.d[slot]) + select(d, vec3u(0u) - d, lane < 8u);
    var found = NOWHERE;
    if (all(at < grid.blocks)) {
        let entry = table.d[block_index(grid, at)] - 1u;
        if (entry < select(grid.capacity, min(live.blocks, grid.capacity), lane < 8u)) { found = entry; }
    }
    links.d[slot * 24u + lane] = found;
    if (lane < 8u) {
        var fill = 0u;
        if (found != NOWHERE) { fill = fills.d[found]; }
        links.d[slot * 24u + 16u + lane] = fill;
    }
}

//! use lib/grid
// Forgets the active blocks of the last substep: their table entries and their cells' counts. One workgroup a slot.

struct Words { d: array<u32> }
@group(0) @binding(0) var<storage, read> list: Words;
@group(0) @binding(1) var<storage, read_write> table: Words;
@group(0) @binding(2) var<storage, read_write> counts: Words;
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    if (group.x >= grid.capacity) { return; }
    counts.d[group.x * 64u + lane] = 0u;
    if (lane == 0u) { table.d[list.d[group.x]] = EMPTY; }
}

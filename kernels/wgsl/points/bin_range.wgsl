//! use lib/tile
// Gives each tile its range in the lists. A workgroup scans 64 tiles and takes their room at once; which group comes
// first does not matter, for what is drawn does not depend on the order of the lists.

struct Words { d: array<u32> }
@group(0) @binding(0) var<storage, read> counts: Words;
@group(0) @binding(1) var<storage, read_write> starts: Words;
@group(0) @binding(2) var<storage, read_write> bins: Bins;
var<immediate> screen: Screen;

var<workgroup> sums: array<u32, 64>;
var<workgroup> first: u32;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let tile = (group.y * groups.x + group.x) * 64u + lane;
    let tiles = tiles_across(screen) * ((screen.height + 7u) / 8u);
    var mine = 0u;
    if (tile < tiles) { mine = counts.d[tile]; }
    sums[lane] = mine;
    workgroupBarrier();
    for (var step = 1u; step < 64u; step <<= 1u) {
        var lower = 0u;
        if (lane >= step) { lower = sums[lane - step]; }
        workgroupBarrier();
        sums[lane] += lower;
        workgroupBarrier();
    }
    if (lane == 63u) {
        first = atomicAdd(&bins.total, sums[63]);
        if (first + sums[63] < first) { atomicStore(&bins.wrapped, 1u); }
    }
    workgroupBarrier();
    if (tile < tiles) { starts.d[tile] = first + sums[lane] - mine; }
}

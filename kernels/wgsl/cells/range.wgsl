//! use lib/grid
// Gives each cell of a block its range in the particle order, and claims the block's seven upper neighbours,
// whose nodes its particles may reach. One workgroup a block.

struct Words { d: array<u32> }
struct AtomicWords { d: array<atomic<u32>> }
@group(0) @binding(0) var<storage, read> counts: Words;
@group(0) @binding(1) var<storage, read_write> starts: Words;
@group(0) @binding(2) var<storage, read_write> table: AtomicWords;
@group(0) @binding(3) var<storage, read_write> list: Words;
@group(0) @binding(4) var<storage, read_write> live: Live;
var<immediate> grid: Grid;

var<workgroup> sums: array<u32, 64>;
var<workgroup> first: u32;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let mine = counts.d[slot * 64u + lane];
    sums[lane] = mine;
    workgroupBarrier();
    for (var step = 1u; step < 64u; step <<= 1u) {
        var lower = 0u;
        if (lane >= step) { lower = sums[lane - step]; }
        workgroupBarrier();
        sums[lane] += lower;
        workgroupBarrier();
    }
    if (lane == 63u) { first = atomicAdd(&live.cursor, sums[63]); }
    workgroupBarrier();
    starts.d[slot * 64u + lane] = first + sums[lane] - mine;
    if (lane >= 1u && lane < 8u) {
        let at = block_coord(grid, list.d[slot]) + vec3u(lane & 1u, (lane >> 1u) & 1u, lane >> 2u);
        if (all(at < grid.blocks)) {
            let block = block_index(grid, at);
            if (atomicLoad(&table.d[block]) == EMPTY && atomicCompareExchangeWeak(&table.d[block], EMPTY, NOWHERE).exchanged) {
                let made = atomicAdd(&live.nodes, 1u);
                if (made < grid.capacity) {
                    list.d[made] = block;
                    atomicStore(&table.d[block], made + 1u);
                } else {
                    atomicAdd(&live.overflow, 1u);
                }
            }
        }
    }
}

//! use lib/grid
// Gives each block a stretch of the particle order and each of its cells a part of that, lists the cells that hold
// particles, and claims the block's seven upper neighbours, whose nodes its particles may reach. Cells share their
// block's stretch in any order; nothing that follows depends on that order. One workgroup a block.

struct Words { d: array<u32> }
struct AtomicWords { d: array<atomic<u32>> }
struct Cells { d: array<Cell> }
struct Spans { d: array<vec2u> }
@group(0) @binding(0) var<storage, read> counts: Words;
@group(0) @binding(1) var<storage, read_write> starts: Words;
@group(0) @binding(2) var<storage, read_write> table: AtomicWords;
@group(0) @binding(3) var<storage, read_write> list: Words;
@group(0) @binding(4) var<storage, read_write> live: Live;
@group(0) @binding(5) var<storage, read_write> spans: Spans;      // of each slot: first place, number of particles
@group(0) @binding(6) var<storage, read_write> occupied: Cells;
@group(0) @binding(7) var<storage, read_write> marks: Words;      // of each cell: its place in `occupied` + 1, or 0
var<immediate> grid: Grid;

var<workgroup> particles: atomic<u32>;
var<workgroup> cells: atomic<u32>;
var<workgroup> first_place: u32;
var<workgroup> first_cell: u32;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let id = slot * 64u + lane;
    let count = counts.d[id];
    var place = 0u;
    var cell = 0u;
    if (count > 0u) {
        place = atomicAdd(&particles, count);
        cell = atomicAdd(&cells, 1u);
    }
    workgroupBarrier();
    if (lane == 0u) {
        let all = atomicLoad(&particles);
        let made = atomicLoad(&cells);
        first_place = atomicAdd(&live.cursor, all);
        first_cell = atomicAdd(&live.cells, made);
        spans.d[slot] = vec2u(first_place, all);
        let end = first_cell + made;
        if (end > grid.cells) { atomicAdd(&live.crowded, min(end - grid.cells, made)); }
        atomicMax(&live.cell_groups, (min(end, grid.cells) + 63u) / 64u);
    }
    workgroupBarrier();
    var mark = 0u;
    if (count > 0u) {
        let first = first_place + place;
        let at = first_cell + cell;
        starts.d[id] = first;
        if (at < grid.cells) {
            occupied.d[at] = Cell(id, first, count, 0u);
            mark = at + 1u;
        }
    }
    marks.d[id] = mark;
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

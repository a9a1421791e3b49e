//! use lib/clock lib/grid lib/tick
// Gives each block a stretch of the particle order, each row of four cells a part of that and each cell a part of its
// row's; lists the rows that hold particles, and claims those of the block's seven upper neighbours whose nodes its
// particles reach. Rows share their block's stretch in any order; nothing that follows depends on it. One workgroup a block;
// the first also chooses the next substep, where solvers ask for that.
//! texels counts: u32

// Chooses the next substep.
override TICKS: bool = false;

struct Words { d: array<u32> }
struct AtomicWords { d: array<atomic<u32>> }
struct Rows { d: array<Row> }
struct Spans { d: array<vec2u> }
@group(0) @binding(0) var counts: texture_1d<u32>;
@group(0) @binding(1) var<storage, read_write> starts: Words;
@group(0) @binding(2) var<storage, read_write> table: AtomicWords;
@group(0) @binding(3) var<storage, read_write> list: Words;
@group(0) @binding(4) var<storage, read_write> live: Live;
@group(0) @binding(5) var<storage, read_write> spans: Spans;      // of each slot: first place, number of particles
@group(0) @binding(6) var<storage, read_write> rows: Rows;
@group(0) @binding(7) var<storage, read_write> marks: Words;      // of each row: its place in `rows` + 1, or 0
@group(0) @binding(8) var<storage, read_write> fills: Words;      // of each slot: bit i, row i holds particles
@group(0) @binding(9) var<storage, read_write> clock: Clock;
var<immediate> grid: Grid;

var<workgroup> particles: atomic<u32>;
var<workgroup> filled: atomic<u32>;
var<workgroup> fill: atomic<u32>;
var<workgroup> reached: atomic<u32>;    // bit i: neighbour i (x first, then y, then z)
var<workgroup> first_place: u32;
var<workgroup> first_row: u32;

// One lane a row.
@compute @workgroup_size(16)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let slot = group.x;
    if (slot >= grid.capacity) {
        if (lane == 0u) { atomicAdd(&live.overflow, 1u); }
        return;
    }
    if (TICKS && slot == 0u && lane == 0u) { tick(); }
    let held = atomicLoad(&live.blocks);
    let block = list.d[slot];
    let id = slot * 16u + lane;
    let cells = textureLoad(counts, id, 0);
    let count = cells.x + cells.y + cells.z + cells.w;
    var place = 0u;
    var row = 0u;
    if (count > 0u) {
        place = atomicAdd(&particles, count);
        row = atomicAdd(&filled, 1u);
        atomicOr(&fill, 1u << lane);
        var to = 1u;
        if (cells.z + cells.w > 0u) { to |= to << 1u; }
        if ((lane & 2u) != 0u) { to |= to << 2u; }
        if ((lane & 8u) != 0u) { to |= to << 4u; }
        atomicOr(&reached, to);
    }
    workgroupBarrier();
    if (lane == 0u) {
        let all = atomicLoad(&particles);
        let made = atomicLoad(&filled);
        first_place = atomicAdd(&live.cursor, all);
        first_row = atomicAdd(&live.rows, made);
        fills.d[slot] = atomicLoad(&fill);
        spans.d[slot] = vec2u(first_place, all);
        let end = first_row + made;
        if (end > grid.rows) { atomicAdd(&live.crowded, min(end - grid.rows, made)); }
        atomicMax(&live.nodes, held);
        atomicMax(&live.row_groups, (min(end, grid.rows) + ROW_LANES - 1u) / ROW_LANES);
    }
    workgroupBarrier();
    var mark = 0u;
    if (count > 0u) {
        let first = first_place + place;
        let at = first_row + row;
        starts.d[id * 4u] = first;
        starts.d[id * 4u + 1u] = first + cells.x;
        starts.d[id * 4u + 2u] = first + cells.x + cells.y;
        starts.d[id * 4u + 3u] = first + cells.x + cells.y + cells.z;
        if (at < grid.rows) {
            rows.d[at] = Row(id, first, count, block);
            mark = at + 1u;
        }
    }
    marks.d[id] = mark;
    if (lane >= 1u && lane < 8u && ((atomicLoad(&reached) >> lane) & 1u) != 0u) {
        let at = block_coord(grid, block) + vec3u(lane & 1u, (lane >> 1u) & 1u, lane >> 2u);
        if (all(at < grid.blocks)) {
            let upper = block_index(grid, at);
            if (atomicLoad(&table.d[upper]) == EMPTY && atomicCompareExchangeWeak(&table.d[upper], EMPTY, NOWHERE).exchanged) {
                let made = held + atomicAdd(&live.upper, 1u);
                atomicMax(&live.nodes, made + 1u);
                if (made < grid.capacity) {
                    list.d[made] = upper;
                    atomicStore(&table.d[upper], made + 1u);
                } else {
                    atomicAdd(&live.overflow, 1u);
                }
            }
        }
    }
}

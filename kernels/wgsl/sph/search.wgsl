//! use lib/sph lib/spot lib/keep
// Lists each particle's neighbours: all within 2 h and the skin, and a few that are a hundredth further. One lane a
// particle, which tests the rows of cells around its own, four candidates a load and 32 a word, a bit each; then it lists
// the bits. Where there is no room for all of them it lists those within 2 h, which hold for this step.
//! texels spots: u32
//! texels table: u32
//! texels starts: u32
//! texels counts: u32

struct Words { d: array<u32> }
struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var spots: texture_1d<u32>;
@group(0) @binding(1) var table: texture_1d<u32>;
@group(0) @binding(2) var starts: texture_1d<u32>;
@group(0) @binding(3) var counts: texture_1d<u32>;
@group(0) @binding(4) var<storage, read> places: Vectors;
@group(0) @binding(5) var<storage, read> live: Counts;
@group(0) @binding(6) var<storage, read_write> clock: Clock;
@group(0) @binding(7) var<storage, read_write> lists: Words;
@group(0) @binding(8) var<storage, read_write> found: Words;       // how many
@group(0) @binding(9) var<storage, read_write> keep: Keep;
var<immediate> grid: Grid;

// First place and number of the particles in cells first.x … last of a row, within one block.
fn stretch(first: vec3i, last: i32, blocks: u32) -> vec2u {
    let b = first >> vec3u(2u);
    if (any(b < vec3i(0)) || any(vec3u(b) >= grid.blocks)) { return vec2u(0u); }
    let slot = word(table, block_index(grid, vec3u(b))) - 1u;
    if (slot >= blocks) { return vec2u(0u); }
    let row = slot * 16u + u32(((first.z & 3) << 2u) | (first.y & 3));
    let start = textureLoad(starts, row, 0).x;
    let held = textureLoad(counts, row, 0);
    let head = u32(first.x & 3);
    let tail = u32(last & 3);
    let cells = vec4u(0u, 1u, 2u, 3u);
    let before = select(vec4u(0u), held, cells < vec4u(head));
    let within = select(vec4u(0u), held, (cells >= vec4u(head)) & (cells <= vec4u(tail)));
    return vec2u(start + before.x + before.y + before.z, within.x + within.y + within.z + within.w);
}

// The bits from `first` on and before `end`, of which those of this word are kept.
fn bits(first: i32, end: i32) -> u32 {
    let a = u32(clamp(first, 0, 32));
    let n = u32(clamp(end, 0, 32)) - min(a, u32(clamp(end, 0, 32)));
    return select(0u, (0xffffffffu >> (32u - n)) << a, n > 0u);
}

// Lists those within a reach (`reach_of`) of particle i, as many as there is room for; how many there are.
fn list_within(reach: f32, i: u32, cell: vec3i, stride: u32, blocks: u32) -> u32 {
    let own = word(spots, i);
    // A cell's row of three is in one block or in two: that of the cell itself, and one beside it at its left or right.
    let low = max(cell.x - 1, cell.x & ~3);
    let high = min(cell.x + 1, cell.x | 3);
    let side = select(cell.x + 1, cell.x - 1, (cell.x & 3) == 0);
    let split = low != cell.x - 1 || high != cell.x + 1;
    var n = 0u;
    for (var row = 0; row < 9; row++) {
        let y = cell.y + row % 3 - 1;
        let z = cell.z + row / 3 - 1;
        let main = stretch(vec3i(low, y, z), high, blocks);
        var beside = vec2u(0u);
        if (split) { beside = stretch(vec3i(side, y, z), side, blocks); }
        // Both stretches as one, in fours: where a load begins, and how many there are.
        let lead = main.x & 3u;
        let fours = (lead + main.y + 3u) >> 2u;
        let total = fours + select(0u, ((beside.x & 3u) + beside.y + 3u) >> 2u, beside.y > 0u);
        let first = main.x >> 2u;
        let second = (beside.x >> 2u) - fours;
        let start = i32(4u * fours + (beside.x & 3u));
        for (var at = 0u; at < total; at += 8u) {
            var near = 0u;
            for (var k = 0u; k < 8u && at + k < total; k++) {
                let load = at + k;
                let four = textureLoad(spots, load + select(second, first, load < fours), 0);
                let hit = select(0u, 1u, near_by(own, four.x, reach)) | select(0u, 2u, near_by(own, four.y, reach))
                    | select(0u, 4u, near_by(own, four.z, reach)) | select(0u, 8u, near_by(own, four.w, reach));
                near |= hit << (4u * k);
            }
            let shift = i32(4u * at);
            near &= bits(i32(lead) - shift, i32(lead + main.y) - shift) | bits(start - shift, start + i32(beside.y) - shift);
            while (near != 0u) {
                let k = 4u * at + firstTrailingBit(near);
                near &= near - 1u;
                let j = k + 4u * select(second, first, k < 4u * fours);
                if (j != i && n < NEIGHBOURS) { lists.d[list_at(stride, i, n)] = j; }
                n += select(0u, 1u, j != i);
            }
        }
    }
    return n;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let stride = clock.particles;
    let placed = live.cursor;
    let blocks = min(live.blocks, grid.capacity);
    let i = id.x;
    if (i >= placed) { return; }
    let cell = vec3i(base_node(grid, places.d[i].xyz));
    var n = 0u;
    for (var skin = keep.skin; ; skin = 0.0) {
        n = list_within(reach_of(grid, 2.0 * h_of() + skin), i, cell, stride, blocks);
        if (n <= NEIGHBOURS || skin == 0.0) { break; }
        atomicStore(&keep.spent, 1u);
    }
    if (n > NEIGHBOURS) { atomicAdd(&clock.clamped_volume, 1u); }
    // The rest of the last four is itself, which gives nothing.
    for (var k = n; k < NEIGHBOURS && (k & 3u) != 0u; k++) { lists.d[list_at(stride, i, k)] = i; }
    found.d[i] = min(n, NEIGHBOURS);
}

//! use lib/sph
// Lists each particle's neighbours and sums over them. One lane a particle, which tests the cells around its own in
// stretches of at most 32 candidates: first all of a stretch, a bit each, then only those within reach.
// On a software driver about half of the time goes to each; unrolling the tests by four changed nothing.
//! texels places: vec4f
//! texels table: u32
//! texels starts: u32
//! texels counts: u32

struct Words { d: array<u32> }
struct Crowds { d: array<Crowd> }
@group(0) @binding(0) var places: texture_1d<u32>;
@group(0) @binding(1) var table: texture_1d<u32>;
@group(0) @binding(2) var starts: texture_1d<u32>;
@group(0) @binding(3) var counts: texture_1d<u32>;
@group(0) @binding(4) var<storage, read> live: Counts;
@group(0) @binding(5) var<storage, read_write> clock: Clock;
@group(0) @binding(6) var<storage, read_write> lists: Words;
@group(0) @binding(7) var<storage, read_write> crowds: Crowds;
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

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let stride = clock.particles;
    let placed = live.cursor;
    let blocks = min(live.blocks, grid.capacity);
    let inv_h = 1.0 / h_of();
    let reach = grid.dx * grid.dx;
    let i = id.x;
    if (i >= placed) { return; }
    let x = texel(places, i).xyz;
    let cell = vec3i(base_node(grid, x));
    var slope = vec3f(0.0);
    var fill = spline(0.0);
    var coupling = 0.0;
    var found = 0u;
    // A cell's row of three is in one block or in two: that of the cell itself, and one beside it at its left or right.
    let low = max(cell.x - 1, cell.x & ~3);
    let high = min(cell.x + 1, cell.x | 3);
    let side = select(cell.x + 1, cell.x - 1, (cell.x & 3) == 0);
    let split = low != cell.x - 1 || high != cell.x + 1;
    for (var row = 0; row < 9; row++) {
        let y = cell.y + row % 3 - 1;
        let z = cell.z + row / 3 - 1;
        let main = stretch(vec3i(low, y, z), high, blocks);
        var beside = vec2u(0u);
        if (split) { beside = stretch(vec3i(side, y, z), side, blocks); }
        let total = main.y + beside.y;
        for (var at = 0u; at < total; at += 32u) {
            let n = min(total - at, 32u);
            var near = 0u;
            for (var k = 0u; k < n; k++) {
                let j = select(beside.x + at + k - main.y, main.x + at + k, at + k < main.y);
                let d = x - texel(places, j).xyz;
                near |= select(0u, 1u << k, dot(d, d) < reach && j != i);
            }
            while (near != 0u) {
                let k = at + firstTrailingBit(near);
                let j = select(beside.x + k - main.y, main.x + k, k < main.y);
                near &= near - 1u;
                let other = texel(places, j);
                let d = x - other.xyz;
                let r = length(d);
                let q = r * inv_h;
                let g = spline_slope(q) * inv_h;
                // Two at the same place push neither.
                slope += d * (g / max(r, 1e-20));
                fill += spline(q);
                coupling += g * g / other.w;
                if (found < NEIGHBOURS) { lists.d[list_at(stride, i, found)] = j; }
                found++;
            }
        }
    }
    if (found > NEIGHBOURS) { atomicAdd(&clock.clamped_volume, 1u); }
    // The rest of the last four is itself, which gives nothing.
    for (var k = found; k < NEIGHBOURS && (k & 3u) != 0u; k++) { lists.d[list_at(stride, i, k)] = i; }
    crowds.d[i] = Crowd(slope, fill, coupling, min(found, NEIGHBOURS), vec2u(0u));
}

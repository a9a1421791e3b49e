//! use lib/node
// Grid update after `mpm/p2g`: gathers the momentum and mass of each node from the rows of cells that reach it, in a
// fixed order, makes it a velocity, and lets it meet the obstacles. One workgroup a slot, one lane four nodes along x.
//! texels shares: vec4f
//! texels marks: u32
//! texels links: u32
//! texels colliders: Colliders

struct Words { d: array<u32> }
struct Nodes { d: array<vec4f> }
@group(0) @binding(0) var shares: texture_1d<u32>;
@group(0) @binding(1) var marks: texture_1d<u32>;
@group(0) @binding(2) var links: texture_1d<u32>;
@group(0) @binding(3) var<storage, read> list: Words;
@group(0) @binding(4) var<storage, read> live: Counts;
@group(0) @binding(5) var<storage, read_write> nodes: Nodes;
@group(0) @binding(6) var<storage, read_write> clock: Clock;
@group(0) @binding(7) var colliders: texture_1d<u32>;
var<immediate> grid: Grid;

var<workgroup> near: atomic<u32>;

@compute @workgroup_size(16)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read first: a software driver makes one load of a uniform address only before any branch.
    let dt = clock.dt;
    let time = clock.frame_start + clock.t + dt;
    let blocks = min(live.blocks, grid.capacity);
    let count = textureLoad(colliders, 0u, 0).x;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let low = grid.origin + vec3f(block_coord(grid, list.d[slot]) * 4u) * grid.dx;
    if (lane < count) { atomicOr(&near, obstacle_near(lane, low, time)); }
    workgroupBarrier();
    let y = lane & 3u;
    let z = lane >> 2u;
    // Slots below: itself, then one down in x, y, xy, z, xz, yz, xyz.
    let near_links = textureLoad(links, slot * 4u, 0);
    let far_links = textureLoad(links, slot * 4u + 1u, 0);
    var n0 = vec4f(0.0);
    var n1 = vec4f(0.0);
    var n2 = vec4f(0.0);
    var n3 = vec4f(0.0);
    for (var row = 0u; row < 9u; row++) {
        let j = row % 3u;
        let k = row / 3u;
        let layer = select(near_links, far_links, k > z);
        let pair = select(layer.xy, layer.zw, j > y);
        let line = ((z - k) & 3u) * 4u + ((y - j) & 3u);
        if (pair.x < blocks) {
            let mark = word(marks, pair.x * 16u + line);
            if (mark != 0u) {
                let at = (mark - 1u) * ROW_SHARES + row;
                n0 += texel(shares, at);
                n1 += texel(shares, at + 9u);
                n2 += texel(shares, at + 18u);
                n3 += texel(shares, at + 27u);
            }
        }
        if (pair.y < blocks) {
            let mark = word(marks, pair.y * 16u + line);
            if (mark != 0u) {
                let at = (mark - 1u) * ROW_SHARES + row;
                n0 += texel(shares, at + 36u);
                n1 += texel(shares, at + 45u);
            }
        }
    }
    let x = low + vec3f(0.0, f32(y), f32(z)) * grid.dx;
    let held = atomicLoad(&near);
    for (var i = 0u; i < 4u; i++) {
        let sum = select(select(n0, n1, i == 1u), select(n2, n3, i == 3u), i >= 2u);
        var v = vec3f(0.0);
        if (sum.w > 0.0) { v = node_velocity(sum, x + vec3f(f32(i) * grid.dx, 0.0, 0.0), held, time, dt); }
        nodes.d[slot * 64u + lane * 4u + i] = vec4f(v, sum.w);
    }
}

//! use lib/node
// Grid update after `mpm/p2g`: gathers each node's momentum and mass from the up to 27 occupied cells that reach it,
// in a fixed order, makes it a velocity, and lets it meet the obstacles. One workgroup a slot.
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

@compute @workgroup_size(64)
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
    let l = vec3u(lane & 3u, (lane >> 2u) & 3u, lane >> 4u);
    // Slots below: itself, then one down in x, y, xy, z, xz, yz, xyz.
    let near_links = textureLoad(links, slot * 4u, 0);
    let far_links = textureLoad(links, slot * 4u + 1u, 0);
    var sum = vec4f(0.0);
    for (var row = 0u; row < 9u; row++) {
        let o = vec2u(row % 3u, row / 3u);
        let layer = select(near_links, far_links, o.y > l.z);
        let pair = select(layer.xy, layer.zw, o.x > l.y);
        let line = ((l.z - o.y) & 3u) * 16u + ((l.y - o.x) & 3u) * 4u;
        for (var i = 0u; i < 3u; i++) {
            let from_slot = select(pair.x, pair.y, i > l.x);
            if (from_slot < blocks) {
                let mark = word(marks, from_slot * 64u + line + ((l.x - i) & 3u));
                if (mark != 0u) { sum += texel(shares, (mark - 1u) * 27u + row * 3u + i); }
            }
        }
    }
    var v = vec3f(0.0);
    if (sum.w > 0.0) { v = node_velocity(sum, low + vec3f(l) * grid.dx, atomicLoad(&near), time, dt); }
    nodes.d[slot * 64u + lane] = vec4f(v, sum.w);
}

//! use lib/forget lib/node
// Grid update after `mpm/p2g_fixed` and `mpm/p2g_float`: gathers each node's momentum and mass from the tiles of up
// to eight blocks in a fixed order, makes it a velocity, and lets it meet the obstacles. Forgets the block's claim and
// counts. One workgroup a slot.
//! texels tiles: vec4f
//! texels links: u32
//! texels colliders: Colliders

// The sort begins anew; else another call looks blocks up first, and does it (`mpm/receive`).
override FORGETS: bool = true;

struct Words { d: array<u32> }
struct Nodes { d: array<vec4f> }
@group(0) @binding(0) var tiles: texture_1d<u32>;
@group(0) @binding(1) var links: texture_1d<u32>;
@group(0) @binding(2) var<storage, read> list: Words;
@group(0) @binding(3) var<storage, read_write> live: Counts;
@group(0) @binding(4) var<storage, read_write> nodes: Nodes;
@group(0) @binding(5) var<storage, read_write> clock: Clock;
@group(0) @binding(6) var colliders: texture_1d<u32>;
@group(0) @binding(7) var<storage, read_write> table: Words;
@group(0) @binding(8) var<storage, read_write> counts: Words;
var<immediate> grid: Grid;

var<workgroup> near: atomic<u32>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read first: a software driver makes one load of a uniform address only before any branch.
    let dt = clock.dt;
    let time = clock.frame_start + clock.t + dt;
    let count = textureLoad(colliders, 0u, 0).x;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let low = grid.origin + vec3f(block_coord(grid, list.d[slot]) * 4u) * grid.dx;
    counts.d[slot * 64u + lane] = 0u;
    if (FORGETS && lane == 0u) { forget(slot, list.d[slot]); }
    if (lane < count) { atomicOr(&near, obstacle_near(lane, low, time)); }
    workgroupBarrier();
    let l = vec3u(lane & 3u, (lane >> 2u) & 3u, lane >> 4u);
    var sum = vec4f(0.0);
    for (var i = 0u; i < 8u; i++) {
        let n = l + 4u * vec3u(i & 1u, (i >> 1u) & 1u, i >> 2u);
        let from_slot = word(links, slot * 24u + i);
        if (from_slot != NOWHERE && all(n < vec3u(6u))) {
            sum += texel(tiles, from_slot * TILE + n.z * 36u + n.y * 6u + n.x);
        }
    }
    let x = low + vec3f(l) * grid.dx;
    var v = node_velocity(sum);
    for (var left = atomicLoad(&near); left != 0u; left &= left - 1u) {
        v = meet(load_collider(firstTrailingBit(left)), x, v, sum.w, time);
    }
    nodes.d[slot * 64u + lane] = node(v, sum.w, dt);
}

//! use lib/forget lib/node
// Grid update after `mpm/p2g`: gathers the momentum and mass of each node from the rows of cells that reach it, in a
// fixed order, makes it a velocity, and lets it meet the obstacles. Forgets the block's claim and counts. One workgroup a
// slot, one lane four nodes along x.
//! texels shares: vec4f
//! texels marks: u32
//! texels links: u32
//! texels colliders: Colliders

// The sort begins anew; else another call looks blocks up first, and does it (`mpm/receive`).
override FORGETS: bool = true;

struct Words { d: array<u32> }
struct Fours { d: array<vec4u> }
struct Nodes { d: array<vec4f> }
@group(0) @binding(0) var shares: texture_1d<u32>;
@group(0) @binding(1) var marks: texture_1d<u32>;
@group(0) @binding(2) var links: texture_1d<u32>;
@group(0) @binding(3) var<storage, read> list: Words;
@group(0) @binding(4) var<storage, read_write> nodes: Nodes;
@group(0) @binding(5) var<storage, read_write> clock: Clock;
@group(0) @binding(6) var colliders: texture_1d<u32>;
@group(0) @binding(7) var<storage, read_write> table: Words;
@group(0) @binding(8) var<storage, read_write> counts: Fours;
@group(0) @binding(9) var<storage, read_write> live: Counts;
var<immediate> grid: Grid;

var<workgroup> near: atomic<u32>;

@compute @workgroup_size(16)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read first: a software driver makes one load of a uniform address only before any branch.
    let dt = clock.dt;
    let time = clock.frame_start + clock.t + dt;
    let count = textureLoad(colliders, 0u, 0).x;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let low = grid.origin + vec3f(block_coord(grid, list.d[slot]) * 4u) * grid.dx;
    counts.d[slot * 16u + lane] = vec4u(0u);
    if (FORGETS && lane == 0u) { forget(slot, list.d[slot]); }
    if (lane < count) { atomicOr(&near, obstacle_near(lane, low, time)); }
    workgroupBarrier();
    let y = lane & 3u;
    let z = lane >> 2u;
    // Slots below (itself, then one down in x, y, xy, z, xz, yz, xyz), and which of their rows hold particles.
    let links_near = textureLoad(links, slot * 6u, 0);
    let links_far = textureLoad(links, slot * 6u + 1u, 0);
    let fill_near = textureLoad(links, slot * 6u + 4u, 0);
    let fill_far = textureLoad(links, slot * 6u + 5u, 0);
    var here = 0u;      // bit k · 3 + j: the row j down in y and k down in z reaches this line of nodes,
    var there = 0u;     // the same one block down in x
    for (var row = 0u; row < 9u; row++) {
        let j = row % 3u;
        let k = row / 3u;
        let layer = select(fill_near, fill_far, k > z);
        let pair = select(layer.xy, layer.zw, j > y) >> vec2u(((z - k) & 3u) * 4u + ((y - j) & 3u));
        here |= (pair.x & 1u) << row;
        there |= (pair.y & 1u) << row;
    }
    var n0 = vec4f(0.0);
    var n1 = vec4f(0.0);
    var n2 = vec4f(0.0);
    var n3 = vec4f(0.0);
    for (; here != 0u; here &= here - 1u) {
        let row = firstTrailingBit(here);
        let at = row_shares(row, y, z, links_near.xz, links_far.xz);
        n0 += texel(shares, at);
        n1 += texel(shares, at + 9u);
        n2 += texel(shares, at + 18u);
        n3 += texel(shares, at + 27u);
    }
    for (; there != 0u; there &= there - 1u) {
        let row = firstTrailingBit(there);
        let at = row_shares(row, y, z, links_near.yw, links_far.yw);
        n0 += texel(shares, at + 36u);
        n1 += texel(shares, at + 45u);
    }
    let x = low + vec3f(0.0, f32(y), f32(z)) * grid.dx;
    let dx = vec3f(grid.dx, 0.0, 0.0);
    var v0 = node_velocity(n0);
    var v1 = node_velocity(n1);
    var v2 = node_velocity(n2);
    var v3 = node_velocity(n3);
    for (var left = atomicLoad(&near); left != 0u; left &= left - 1u) {
        let c = load_collider(firstTrailingBit(left));
        v0 = meet(c, x, v0, n0.w, time);
        v1 = meet(c, x + dx, v1, n1.w, time);
        v2 = meet(c, x + 2.0 * dx, v2, n2.w, time);
        v3 = meet(c, x + 3.0 * dx, v3, n3.w, time);
    }
    let to = slot * 64u + lane * 4u;
    nodes.d[to] = node(v0, n0.w, dt);
    nodes.d[to + 1u] = node(v1, n1.w, dt);
    nodes.d[to + 2u] = node(v2, n2.w, dt);
    nodes.d[to + 3u] = node(v3, n3.w, dt);
}

// First share of a row given as in `here`; slots of the blocks at its y and one down, in the two layers.
fn row_shares(row: u32, y: u32, z: u32, near_slots: vec2u, far_slots: vec2u) -> u32 {
    let j = row % 3u;
    let k = row / 3u;
    let layer = select(near_slots, far_slots, k > z);
    let from_slot = select(layer.x, layer.y, j > y);
    let mark = word(marks, from_slot * 16u + ((z - k) & 3u) * 4u + ((y - j) & 3u));
    // Rows that found no room have no shares; the frame is repeated with more.
    return select((mark - 1u) * ROW_SHARES, 0u, mark == 0u) + row;
}

//! use lib/grid lib/clock lib/collider lib/particle
// Grid update: gathers each node's momentum and mass from the tiles of up to eight blocks in a fixed order, makes
// it a velocity, and lets it meet the obstacles. One workgroup a block of nodes.

// Mass below which a node's slowing down is not counted [kg]: the gradient of a B-spline falls off slower than its
// weight, so nodes at the rim of a body are thrown about however short the step, and carry next to nothing.
override SPARSE: f32 = 0.0;

struct Words { d: array<u32> }
struct Tiles { d: array<vec4f> }
struct Nodes { d: array<vec4f> }
struct Colliders { count: u32, d: array<Collider, 16> }
@group(0) @binding(0) var<storage, read> tiles: Tiles;
@group(0) @binding(1) var<storage, read> table: Words;
@group(0) @binding(2) var<storage, read> list: Words;
@group(0) @binding(3) var<storage, read> live: LiveBlocks;
@group(0) @binding(4) var<storage, read_write> nodes: Nodes;
@group(0) @binding(5) var<storage, read_write> clock: Clock;
@group(0) @binding(6) var<storage, read> colliders: Colliders;
var<immediate> grid: Grid;

// The counters, read only.
struct LiveBlocks { blocks: u32 }

var<workgroup> from_slot: array<u32, 8>;
var<workgroup> near: array<u32, 16>;    // obstacles that may hold nodes of this block

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read first: a software driver makes one load of a uniform address only before any branch.
    let dt = clock.dt;
    let time = clock.frame_start + clock.t + dt;
    let count = colliders.count;
    let here = live.blocks;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let block = block_coord(grid, list.d[slot]);
    if (lane < 8u) {
        let d = vec3u(lane & 1u, (lane >> 1u) & 1u, lane >> 2u);
        var found = NOWHERE;
        if (all(block >= d)) {
            let entry = table.d[block_index(grid, block - d)] - 1u;
            if (entry < min(here, grid.capacity)) { found = entry; }
        }
        from_slot[lane] = found;
    }
    if (lane < count) {
        // Half the diagonal of 3 × 3 × 3 cells around the block's middle.
        let middle = grid.origin + (vec3f(block * 4u) + vec3f(1.5)) * grid.dx;
        near[lane] = select(0u, 1u, gap(colliders.d[lane], middle, time) <= 2.6 * grid.dx);
    }
    workgroupBarrier();
    let l = vec3u(lane & 3u, (lane >> 2u) & 3u, lane >> 4u);
    var sum = vec4f(0.0);
    for (var i = 0u; i < 8u; i++) {
        let d = vec3u(i & 1u, (i >> 1u) & 1u, i >> 2u);
        let n = l + 4u * d;
        if (from_slot[i] != NOWHERE && all(n < vec3u(6u))) {
            sum += tiles.d[from_slot[i] * TILE + n.z * 36u + n.y * 6u + n.x];
        }
    }
    var v = vec3f(0.0);
    if (sum.w > 0.0) {
        v = sum.xyz / sum.w;
        // One bad particle must not poison all it touches.
        if (!finite(v)) {
            v = vec3f(0.0);
            atomicAdd(&clock.clamped_velocity, 1u);
        }
        let x = grid.origin + vec3f(block * 4u + l) * grid.dx;
        for (var i = 0u; i < count; i++) {
            if (near[i] != 0u) { v = collide(colliders.d[i], x, v, time); }
        }
        // Nothing may cross more than a cell in a step; a sparsely filled node can be thrown faster than that.
        let fastest = 0.9 * grid.dx / dt;
        let speed = length(v);
        if (!(speed <= fastest)) {
            v *= fastest / speed;
            if (sum.w > SPARSE) { atomicAdd(&clock.clamped_velocity, 1u); }
        }
    }
    nodes.d[slot * 64u + lane] = vec4f(v, sum.w);
}

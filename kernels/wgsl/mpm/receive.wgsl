//! use lib/forget lib/node
// Nodes of the grid take what bodies on grids of their own have given them (`lagrangian/press`), after all else that
// happens to nodes, and meet the obstacles once more where that was anything. Then the block's claim is forgotten, which the
// grid update leaves to this call. One workgroup a slot, one lane a node.
//! texels colliders: Colliders

// What one step of the sums stands for [kg m/s].
override UNIT: f32 = 1e-9;

struct Words { d: array<u32> }
struct Nodes { d: array<vec4f> }
struct Whole { d: array<i32> }
@group(0) @binding(0) var<storage, read> list: Words;
@group(0) @binding(1) var<storage, read_write> live: Counts;
@group(0) @binding(2) var<storage, read_write> nodes: Nodes;
@group(0) @binding(3) var<storage, read_write> clock: Clock;
@group(0) @binding(4) var colliders: texture_1d<u32>;
@group(0) @binding(5) var<storage, read_write> table: Words;
@group(0) @binding(6) var<storage, read_write> gifts: Whole;     // three a node: impulse in units
var<immediate> grid: Grid;

var<workgroup> near: atomic<u32>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let dt = clock.dt;
    let time = clock.frame_start + clock.t + dt;
    let count = textureLoad(colliders, 0u, 0).x;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let low = grid.origin + vec3f(block_coord(grid, list.d[slot]) * 4u) * grid.dx;
    if (lane == 0u) { forget(slot, list.d[slot]); }
    if (lane < count) { atomicOr(&near, obstacle_near(lane, low, time)); }
    workgroupBarrier();
    let at = slot * 64u + lane;
    let given = vec3i(gifts.d[3u * at], gifts.d[3u * at + 1u], gifts.d[3u * at + 2u]);
    let was = nodes.d[at];
    let pushed = any(given != vec3i(0)) && was.w > 0.0;
    let x = low + vec3f(f32(lane & 3u), f32((lane >> 2u) & 3u), f32(lane >> 4u)) * grid.dx;
    var v = was.xyz + select(vec3f(0.0), vec3f(given) * (UNIT / max(was.w, 1e-30)), pushed);
    for (var left = select(0u, atomicLoad(&near), pushed); left != 0u; left &= left - 1u) {
        v = meet(load_collider(firstTrailingBit(left)), x, v, was.w, time);
    }
    if (pushed) { nodes.d[at] = node(v, was.w, dt); }
    for (var a = 0u; a < 3u; a++) { gifts.d[3u * at + a] = 0; }
}

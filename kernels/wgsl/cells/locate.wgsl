//! use lib/clock lib/grid lib/particle lib/texel
// Finds each particle's cell and claims its block. A particle that is not finite or has left the grid is
// quarantined. Slots are claimed in any order; nothing that follows depends on that order.
//! texels was: Particle
//! texels claimed: u32

struct Particles { d: array<Particle> }
struct Words { d: array<u32> }
struct AtomicWords { d: array<atomic<u32>> }
@group(0) @binding(0) var<storage, read_write> particles: Particles;
@group(0) @binding(1) var<storage, read_write> keys: Words;
@group(0) @binding(2) var<storage, read_write> table: AtomicWords;
@group(0) @binding(3) var<storage, read_write> list: Words;
@group(0) @binding(4) var<storage, read_write> live: Live;
@group(0) @binding(5) var<storage, read_write> clock: Clock;
// The same particles and table, read: most blocks are claimed already, and a plain look is cheaper than an atomic one.
@group(0) @binding(6) var was: texture_1d<u32>;
@group(0) @binding(7) var claimed: texture_1d<u32>;
@group(0) @binding(8) var<storage, read> awake: Words;      // groups of 64 particles of which any moves
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let p = awake.d[group.x] * 64u + lane;
    if (p >= clock.particles) { return; }
    let head = texel(was, 6u * p);
    let tag = bitcast<u32>(head.w);
    if ((tag & (QUARANTINED | ASLEEP)) != 0u) {
        keys.d[p] = NOWHERE;
        return;
    }
    let x = head.xyz;
    let base = base_node(grid, x);
    if (!finite(x) || !finite(texel(was, 6u * p + 1u).xyz) || !inside(grid, base)) {
        particles.d[p].tag = tag | QUARANTINED;
        atomicAdd(&clock.quarantined, 1u);
        keys.d[p] = NOWHERE;
        return;
    }
    let node = vec3u(base);
    let cell = node & vec3u(3u);
    let block = block_index(grid, node >> vec3u(2u));
    keys.d[p] = (block << 6u) | (cell.z << 4u) | (cell.y << 2u) | cell.x;
    if (word(claimed, block) != EMPTY) { return; }
    let won = atomicCompareExchangeWeak(&table.d[block], EMPTY, NOWHERE);
    if (won.exchanged) {
        let slot = atomicAdd(&live.blocks, 1u);
        atomicAdd(&live.nodes, 1u);
        if (slot < grid.capacity) {
            list.d[slot] = block;
            atomicStore(&table.d[block], slot + 1u);
        } else {
            atomicAdd(&live.overflow, 1u);
        }
    }
}

//! use lib/scatter
// Particles to grid with native float atomics: a lane a particle; neighbouring lanes of one cell are summed by
// subgroup shuffles first, so that a cell's particles cost one atomic a node and subgroup. Bits depend on order.

//! texels particles: Particle
//! texels bodies: Body
//! texels order: u32
//! texels spans: vec2u
//! texels forces: Forces

struct Tiles { d: array<atomic<f32>> }
@group(0) @binding(0) var particles: texture_1d<u32>;
@group(0) @binding(1) var bodies: texture_1d<u32>;
@group(0) @binding(2) var order: texture_1d<u32>;
@group(0) @binding(3) var spans: texture_1d<u32>;     // of each slot: first place, number of particles
@group(0) @binding(4) var<storage, read_write> tiles: Tiles;
@group(0) @binding(5) var<storage, read> clock: Clock;
@group(0) @binding(6) var forces: texture_1d<u32>;
var<immediate> grid: Grid;

// Sums x over the run of lanes with the same cell that ends in each lane (a segmented scan, Hillis & Steele 1986).
fn run_sum(x: vec4f, run: u32, lanes: u32) -> vec4f {
    var sum = x;
    for (var step = 1u; step < lanes; step <<= 1u) {
        let other = subgroupShuffleUp(sum, step);
        if (step <= run) { sum += other; }
    }
    return sum;
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(local_invocation_index) lane: u32,
    @builtin(subgroup_size) lanes: u32,
    @builtin(subgroup_invocation_id) me: u32,
) {
    // Read once and first: a software driver makes one load of a uniform address only before any branch.
    let origin = grid.origin;
    let dx = grid.dx;
    let dt = clock.dt;
    let time = clock.frame_start + clock.t;
    let field_count = textureLoad(forces, 0u, 0).x;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    for (var i = lane; i < 4u * TILE; i += 64u) { atomicStore(&tiles.d[slot * 4u * TILE + i], 0.0); }
    storageBarrier();
    let first = word(spans, 2u * slot);
    let last = first + word(spans, 2u * slot + 1u);
    for (var round = first; round < last; round += 64u) {
        let i = round + lane;
        let here = i < last;
        let p = load_particle(particles, word(order, min(i, last - 1u)));
        let body = load_body(bodies, p.tag & BODY_MASK);
        let a = body_acceleration(p, body.fields, body.gravity, field_count, time);
        let base = base_node(grid, p.x);
        let s = scatter(p, a, base, origin, dx, dt);
        let local = vec3u(base) & vec3u(3u);
        var cell = local.z * 36u + local.y * 6u + local.x;
        if (!here) { cell = TILE; }
        // How many lanes before this one hold particles of the same cell: particles come sorted by cell.
        var run = 0u;
        for (var step = 1u; step < lanes; step++) {
            let other = subgroupShuffleUp(cell, step);
            if (me >= step && other == cell && run == step - 1u) { run = step; }
        }
        let after = subgroupShuffleDown(cell, 1u);
        let ends = here && (me == lanes - 1u || after != cell);
        for (var n = 0u; n < 27u; n++) {
            let o = vec3u(n % 3u, (n / 3u) % 3u, n / 9u);
            let sum = run_sum(select(vec4f(0.0), share(s, scatter_row(s, o.y, o.z), o.x), here), run, lanes);
            if (ends) {
                let at = 4u * (slot * TILE + cell + o.z * 36u + o.y * 6u + o.x);
                atomicAdd(&tiles.d[at], sum.x);
                atomicAdd(&tiles.d[at + 1u], sum.y);
                atomicAdd(&tiles.d[at + 2u], sum.z);
                atomicAdd(&tiles.d[at + 3u], sum.w);
            }
        }
    }
}

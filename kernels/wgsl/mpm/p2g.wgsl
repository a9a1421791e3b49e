//! use lib/scatter
// Particles to grid, deterministic and without atomics: one lane owns a cell and sums its particles, in the order
// of their numbers, into 27 private nodes; then the 64 lanes of a block add them into the block's tile one stencil
// place at a time, so that no two lanes meet at a node. One workgroup a block.

struct Particles { d: array<Particle> }
struct Bodies { d: array<Body> }
struct Words { d: array<u32> }
struct Tiles { d: array<vec4f> }
@group(0) @binding(0) var<storage, read> particles: Particles;
@group(0) @binding(1) var<storage, read> bodies: Bodies;
@group(0) @binding(2) var<storage, read_write> order: Words;
@group(0) @binding(3) var<storage, read> starts: Words;
@group(0) @binding(4) var<storage, read> counts: Words;
@group(0) @binding(5) var<storage, read_write> tiles: Tiles;
@group(0) @binding(6) var<storage, read> clock: Clock;
@group(0) @binding(7) var<storage, read> forces: Forces;
var<immediate> grid: Grid;

var<workgroup> tile: array<vec4f, TILE>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read once and first: a software driver makes one load of a uniform address only before any branch.
    let origin = grid.origin;
    let dx = grid.dx;
    let dt = clock.dt;
    let time = clock.frame_start + clock.t;
    let gravity = forces.gravity.xyz;
    let field_count = forces.count;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    let first = starts.d[slot * 64u + lane];
    let last = first + counts.d[slot * 64u + lane];
    // Sums depend on their order: sort the cell's few particles by number.
    for (var i = first + 1u; i < last; i++) {
        let p = order.d[i];
        var j = i;
        while (j > first && order.d[j - 1u] > p) {
            order.d[j] = order.d[j - 1u];
            j -= 1u;
        }
        if (j != i) { order.d[j] = p; }
    }
    var n000 = vec4f(0.0);
    var n100 = vec4f(0.0);
    var n200 = vec4f(0.0);
    var n010 = vec4f(0.0);
    var n110 = vec4f(0.0);
    var n210 = vec4f(0.0);
    var n020 = vec4f(0.0);
    var n120 = vec4f(0.0);
    var n220 = vec4f(0.0);
    var n001 = vec4f(0.0);
    var n101 = vec4f(0.0);
    var n201 = vec4f(0.0);
    var n011 = vec4f(0.0);
    var n111 = vec4f(0.0);
    var n211 = vec4f(0.0);
    var n021 = vec4f(0.0);
    var n121 = vec4f(0.0);
    var n221 = vec4f(0.0);
    var n002 = vec4f(0.0);
    var n102 = vec4f(0.0);
    var n202 = vec4f(0.0);
    var n012 = vec4f(0.0);
    var n112 = vec4f(0.0);
    var n212 = vec4f(0.0);
    var n022 = vec4f(0.0);
    var n122 = vec4f(0.0);
    var n222 = vec4f(0.0);
    // The body changes rarely from particle to particle.
    var body = NOWHERE;
    var fields = 0u;
    for (var i = first; i < last; i++) {
        let p = particles.d[order.d[i]];
        if ((p.tag & BODY_MASK) != body) {
            body = p.tag & BODY_MASK;
            fields = bodies.d[body].fields;
        }
        let a = body_acceleration(p, fields, gravity, field_count, time);
        let s = scatter(p, a, origin, dx, dt);
        let r00 = scatter_row(s, 0u, 0u);
        n000 += share(s, r00, 0u);
        n100 += share(s, r00, 1u);
        n200 += share(s, r00, 2u);
        let r10 = scatter_row(s, 1u, 0u);
        n010 += share(s, r10, 0u);
        n110 += share(s, r10, 1u);
        n210 += share(s, r10, 2u);
        let r20 = scatter_row(s, 2u, 0u);
        n020 += share(s, r20, 0u);
        n120 += share(s, r20, 1u);
        n220 += share(s, r20, 2u);
        let r01 = scatter_row(s, 0u, 1u);
        n001 += share(s, r01, 0u);
        n101 += share(s, r01, 1u);
        n201 += share(s, r01, 2u);
        let r11 = scatter_row(s, 1u, 1u);
        n011 += share(s, r11, 0u);
        n111 += share(s, r11, 1u);
        n211 += share(s, r11, 2u);
        let r21 = scatter_row(s, 2u, 1u);
        n021 += share(s, r21, 0u);
        n121 += share(s, r21, 1u);
        n221 += share(s, r21, 2u);
        let r02 = scatter_row(s, 0u, 2u);
        n002 += share(s, r02, 0u);
        n102 += share(s, r02, 1u);
        n202 += share(s, r02, 2u);
        let r12 = scatter_row(s, 1u, 2u);
        n012 += share(s, r12, 0u);
        n112 += share(s, r12, 1u);
        n212 += share(s, r12, 2u);
        let r22 = scatter_row(s, 2u, 2u);
        n022 += share(s, r22, 0u);
        n122 += share(s, r22, 1u);
        n222 += share(s, r22, 2u);
    }
    let at = (lane >> 4u) * 36u + ((lane >> 2u) & 3u) * 6u + (lane & 3u);
    tile[at + 0u] += n000;
    workgroupBarrier();
    tile[at + 1u] += n100;
    workgroupBarrier();
    tile[at + 2u] += n200;
    workgroupBarrier();
    tile[at + 6u] += n010;
    workgroupBarrier();
    tile[at + 7u] += n110;
    workgroupBarrier();
    tile[at + 8u] += n210;
    workgroupBarrier();
    tile[at + 12u] += n020;
    workgroupBarrier();
    tile[at + 13u] += n120;
    workgroupBarrier();
    tile[at + 14u] += n220;
    workgroupBarrier();
    tile[at + 36u] += n001;
    workgroupBarrier();
    tile[at + 37u] += n101;
    workgroupBarrier();
    tile[at + 38u] += n201;
    workgroupBarrier();
    tile[at + 42u] += n011;
    workgroupBarrier();
    tile[at + 43u] += n111;
    workgroupBarrier();
    tile[at + 44u] += n211;
    workgroupBarrier();
    tile[at + 48u] += n021;
    workgroupBarrier();
    tile[at + 49u] += n121;
    workgroupBarrier();
    tile[at + 50u] += n221;
    workgroupBarrier();
    tile[at + 72u] += n002;
    workgroupBarrier();
    tile[at + 73u] += n102;
    workgroupBarrier();
    tile[at + 74u] += n202;
    workgroupBarrier();
    tile[at + 78u] += n012;
    workgroupBarrier();
    tile[at + 79u] += n112;
    workgroupBarrier();
    tile[at + 80u] += n212;
    workgroupBarrier();
    tile[at + 84u] += n022;
    workgroupBarrier();
    tile[at + 85u] += n122;
    workgroupBarrier();
    tile[at + 86u] += n222;
    workgroupBarrier();
    for (var i = lane; i < TILE; i += 64u) { tiles.d[slot * TILE + i] = tile[i]; }
}

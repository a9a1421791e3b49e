//! use lib/scatter lib/load
// Particles to grid, deterministic and without atomics: one lane owns an occupied cell, sums its particles, in the
// order of their numbers, into 27 private nodes and writes these; `mpm/grid_cells` gathers them. For CPU devices.

//! texels particles: Particle
//! texels bodies: Body
//! texels placed: u32
//! texels occupied: Cell
//! texels forces: Forces

struct Words { d: array<u32> }
struct Shares { d: array<vec4f> }
@group(0) @binding(0) var particles: texture_1d<u32>;
@group(0) @binding(1) var bodies: texture_1d<u32>;
@group(0) @binding(2) var<storage, read_write> order: Words;
@group(0) @binding(3) var placed: texture_1d<u32>;                // `order` as `cells/place` left it
@group(0) @binding(4) var occupied: texture_1d<u32>;
@group(0) @binding(5) var<storage, read_write> shares: Shares;    // 27 an occupied cell, x first, then y, then z
@group(0) @binding(6) var<storage, read> live: Counts;
@group(0) @binding(7) var<storage, read> clock: Clock;
@group(0) @binding(8) var forces: texture_1d<u32>;
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    // Read once and first: a software driver makes one load of a uniform address only before any branch.
    let origin = grid.origin;
    let dx = grid.dx;
    let dt = clock.dt;
    let time = clock.frame_start + clock.t;
    let cells = min(live.cells, grid.cells);
    let gravity = texel(forces, 0u).xyz;
    let field_count = textureLoad(forces, 1u, 0).x;
    if (id.x >= cells) { return; }
    let cell = load_cell(occupied, id.x);
    let last = cell.first + cell.count;
    // Sums depend on their order: the cell's few particles go by number. Mostly they came so already.
    var sorted = true;
    var before = 0u;
    for (var i = cell.first; i < last; i++) {
        let p = word(placed, i);
        sorted = sorted && p >= before;
        before = p;
    }
    if (!sorted) {
        for (var i = cell.first + 1u; i < last; i++) {
            let p = order.d[i];
            var j = i;
            while (j > cell.first && order.d[j - 1u] > p) {
                order.d[j] = order.d[j - 1u];
                j -= 1u;
            }
            order.d[j] = p;
        }
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
    for (var i = cell.first; i < last; i++) {
        // What this lane wrote it must read where it wrote it.
        var index = 0u;
        if (sorted) { index = word(placed, i); } else { index = order.d[i]; }
        let p = load_particle(particles, index);
        if ((p.tag & BODY_MASK) != body) {
            body = p.tag & BODY_MASK;
            fields = load_body(bodies, body).fields;
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
    shares.d[27u * id.x + 0u] = n000;
    shares.d[27u * id.x + 1u] = n100;
    shares.d[27u * id.x + 2u] = n200;
    shares.d[27u * id.x + 3u] = n010;
    shares.d[27u * id.x + 4u] = n110;
    shares.d[27u * id.x + 5u] = n210;
    shares.d[27u * id.x + 6u] = n020;
    shares.d[27u * id.x + 7u] = n120;
    shares.d[27u * id.x + 8u] = n220;
    shares.d[27u * id.x + 9u] = n001;
    shares.d[27u * id.x + 10u] = n101;
    shares.d[27u * id.x + 11u] = n201;
    shares.d[27u * id.x + 12u] = n011;
    shares.d[27u * id.x + 13u] = n111;
    shares.d[27u * id.x + 14u] = n211;
    shares.d[27u * id.x + 15u] = n021;
    shares.d[27u * id.x + 16u] = n121;
    shares.d[27u * id.x + 17u] = n221;
    shares.d[27u * id.x + 18u] = n002;
    shares.d[27u * id.x + 19u] = n102;
    shares.d[27u * id.x + 20u] = n202;
    shares.d[27u * id.x + 21u] = n012;
    shares.d[27u * id.x + 22u] = n112;
    shares.d[27u * id.x + 23u] = n212;
    shares.d[27u * id.x + 24u] = n022;
    shares.d[27u * id.x + 25u] = n122;
    shares.d[27u * id.x + 26u] = n222;
}

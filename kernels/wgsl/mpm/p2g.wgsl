//! use lib/scatter lib/load
// Particles to grid, deterministic and without atomics: one lane walks an occupied row of four cells. It sums the
// particles of a cell, in the order of their numbers, into 27 private nodes and writes the nine it leaves behind as it
// goes on to the next cell; `mpm/grid_rows` gathers them. For CPU devices.

//! texels particles: Particle
//! texels bodies: Body
//! texels placed: u32
//! texels rows: Row
//! texels counts: u32
//! texels forces: Forces

struct Words { d: array<u32> }
struct Shares { d: array<vec4f> }
@group(0) @binding(0) var particles: texture_1d<u32>;
@group(0) @binding(1) var bodies: texture_1d<u32>;
@group(0) @binding(2) var<storage, read_write> order: Words;
@group(0) @binding(3) var placed: texture_1d<u32>;                // `order` as `cells/place` left it
@group(0) @binding(4) var rows: texture_1d<u32>;
@group(0) @binding(5) var<storage, read_write> shares: Shares;    // ROW_SHARES an occupied row
@group(0) @binding(6) var<storage, read> live: Counts;
@group(0) @binding(7) var<storage, read> clock: Clock;
@group(0) @binding(8) var forces: texture_1d<u32>;
@group(0) @binding(9) var counts: texture_1d<u32>;
var<immediate> grid: Grid;

@compute @workgroup_size(ROW_LANES)
fn main(@builtin(global_invocation_id) id: vec3u) {
    // Read once and first: a software driver makes one load of a uniform address only before any branch.
    let origin = grid.origin;
    let dx = grid.dx;
    let dt = clock.dt;
    let time = clock.frame_start + clock.t;
    let filled = min(live.rows, grid.rows);
    let field_count = textureLoad(forces, 0u, 0).x;
    if (id.x >= filled) { return; }
    let row = load_row(rows, id.x);
    let last = row.first + row.count;
    // Where the second, third and fourth cell of the row begin.
    let held = textureLoad(counts, row.id, 0);
    let begin = vec3u(row.first) + vec3u(held.x, held.x + held.y, held.x + held.y + held.z);
    // Sums depend on their order: a cell's few particles go by number. Mostly they came so already.
    var sorted = true;
    var before = 0u;
    for (var i = row.first; i < last; i++) {
        let p = word(placed, i);
        sorted = sorted && (p >= before || any(begin == vec3u(i)));
        before = p;
    }
    if (!sorted) {
        // By Shell's steps: a crowd in one cell would keep a plain insertion busy for its number squared.
        var step = 1u;
        while (step < row.count / 3u) { step = 3u * step + 1u; }
        for (; step > 0u; step = step / 3u) {
            for (var i = row.first + step; i < last; i++) {
                let p = order.d[i];
                let cell = begin <= vec3u(i);
                let least = step + max(row.first, max(select(0u, begin.x, cell.x), max(select(0u, begin.y, cell.y), select(0u, begin.z, cell.z))));
                var j = i;
                while (j >= least && order.d[j - step] > p) {
                    order.d[j] = order.d[j - step];
                    j -= step;
                }
                order.d[j] = p;
            }
        }
    }
    // Nodes of the cell at hand; those it leaves behind are done. Each has a name: an array indexed at run time would
    // live in memory, and takes drivers long to compile.
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
    var gravity = vec3f(0.0);
    let base = row_base(row);
    var out = id.x * ROW_SHARES;
    var i = row.first;
    for (var cell = 0u; cell < 4u; cell++) {
        let next = select(last, begin[min(cell, 2u)], cell < 3u);
        for (; i < next; i++) {
            // What this lane wrote it must read where it wrote it.
            var index = 0u;
            if (sorted) { index = word(placed, i); } else { index = order.d[i]; }
            let p = load_particle(particles, index);
            if ((p.tag & BODY_MASK) != body) {
                body = p.tag & BODY_MASK;
                let its = load_body(bodies, body);
                fields = its.fields;
                gravity = its.gravity;
            }
            let a = body_acceleration(p, fields, gravity, field_count, time);
            let s = scatter(p, a, base + vec3f(f32(cell), 0.0, 0.0), origin, dx, dt);
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
        shares.d[out + 0u] = n000;
        shares.d[out + 1u] = n010;
        shares.d[out + 2u] = n020;
        shares.d[out + 3u] = n001;
        shares.d[out + 4u] = n011;
        shares.d[out + 5u] = n021;
        shares.d[out + 6u] = n002;
        shares.d[out + 7u] = n012;
        shares.d[out + 8u] = n022;
        n000 = n100;
        n100 = n200;
        n200 = vec4f(0.0);
        n010 = n110;
        n110 = n210;
        n210 = vec4f(0.0);
        n020 = n120;
        n120 = n220;
        n220 = vec4f(0.0);
        n001 = n101;
        n101 = n201;
        n201 = vec4f(0.0);
        n011 = n111;
        n111 = n211;
        n211 = vec4f(0.0);
        n021 = n121;
        n121 = n221;
        n221 = vec4f(0.0);
        n002 = n102;
        n102 = n202;
        n202 = vec4f(0.0);
        n012 = n112;
        n112 = n212;
        n212 = vec4f(0.0);
        n022 = n122;
        n122 = n222;
        n222 = vec4f(0.0);
        out += 9u;
    }
    shares.d[out + 0u] = n000;
    shares.d[out + 1u] = n010;
    shares.d[out + 2u] = n020;
    shares.d[out + 3u] = n001;
    shares.d[out + 4u] = n011;
    shares.d[out + 5u] = n021;
    shares.d[out + 6u] = n002;
    shares.d[out + 7u] = n012;
    shares.d[out + 8u] = n022;
    shares.d[out + 9u] = n100;
    shares.d[out + 10u] = n110;
    shares.d[out + 11u] = n120;
    shares.d[out + 12u] = n101;
    shares.d[out + 13u] = n111;
    shares.d[out + 14u] = n121;
    shares.d[out + 15u] = n102;
    shares.d[out + 16u] = n112;
    shares.d[out + 17u] = n122;
}

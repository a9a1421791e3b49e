//! use lib/stress lib/rows
// Forces of the thin parts of cells on their nodes, added to those of `lagrangian/force`. A particle is a box; where a body
// is only one or two of them thick, one point in each would feel little or nothing of bending (a layer of points has no
// second moment, and folds), so each box is integrated by two Gauss points along every thin axis. Those come as a list,
// four at a time. One lane a cell.
// Four places: some 4000 operations, 4 loads; a cell besides 27 displacements and 27 sums, read and written.
//! texels cells: ElasticCell
//! texels solids: Solid
//! texels thins: ThinCell
//! texels places: Place
//! texels u: vec4f
//! texels v: vec4f
//! texels shares_was: vec4f

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var cells: texture_1d<u32>;
@group(0) @binding(1) var solids: texture_1d<u32>;
@group(0) @binding(2) var thins: texture_1d<u32>;
@group(0) @binding(3) var places: texture_1d<u32>;
@group(0) @binding(4) var u: texture_1d<u32>;               // displacement of the nodes [m]
@group(0) @binding(5) var shares_was: texture_1d<u32>;      // the same buffer, read and then written by its lane
@group(0) @binding(6) var<storage, read_write> shares: Vectors;
@group(0) @binding(7) var<storage, read_write> clock: Clock;
@group(0) @binding(8) var v: texture_1d<u32>;               // velocity of the nodes [m/s]
var<immediate> reference: Reference;

// To a row with weights wyz, its derivatives along y and z in `slopes`.
fn give(to: Row, p: mat3x3f, w: Weights, wyz: f32, slopes: vec2f) -> Row {
    let x = wyz * p[0];
    let v = slopes.x * p[1] + slopes.y * p[2];
    return Row(to.l + w.gx.x * x + w.wx.x * v, to.m + w.gx.y * x + w.wx.y * v, to.r + w.gx.z * x + w.wx.z * v);
}

fn spread(to: Rows, p: mat3x3f, w: Weights) -> Rows {
    return Rows(
        give(to.a, p, w, w.wy.x * w.wz.x, vec2f(w.gy.x * w.wz.x, w.wy.x * w.gz.x)),
        give(to.b, p, w, w.wy.y * w.wz.x, vec2f(w.gy.y * w.wz.x, w.wy.y * w.gz.x)),
        give(to.c, p, w, w.wy.z * w.wz.x, vec2f(w.gy.z * w.wz.x, w.wy.z * w.gz.x)),
        give(to.d, p, w, w.wy.x * w.wz.y, vec2f(w.gy.x * w.wz.y, w.wy.x * w.gz.y)),
        give(to.e, p, w, w.wy.y * w.wz.y, vec2f(w.gy.y * w.wz.y, w.wy.y * w.gz.y)),
        give(to.f, p, w, w.wy.z * w.wz.y, vec2f(w.gy.z * w.wz.y, w.wy.z * w.gz.y)),
        give(to.g, p, w, w.wy.x * w.wz.z, vec2f(w.gy.x * w.wz.z, w.wy.x * w.gz.z)),
        give(to.h, p, w, w.wy.y * w.wz.z, vec2f(w.gy.y * w.wz.z, w.wy.y * w.gz.z)),
        give(to.i, p, w, w.wy.z * w.wz.z, vec2f(w.gy.z * w.wz.z, w.wy.z * w.gz.z)));
}

fn put(to: u32, row: u32, r: Row) {
    let first = to + 3u * row * reference.cells;
    let was = load(shares_was, first, reference.cells);
    shares.d[first] = vec4f(was.l + r.l, 0.0);
    shares.d[first + reference.cells] = vec4f(was.m + r.m, 0.0);
    shares.d[first + 2u * reference.cells] = vec4f(was.r + r.r, 0.0);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= reference.thin) { return; }
    let thin = textureLoad(thins, id.x, 0);
    let low = textureLoad(cells, 3u * thin.x, 0);
    let high = textureLoad(cells, 3u * thin.x + 1u, 0);
    let last = textureLoad(cells, 3u * thin.x + 2u, 0);
    let solid = load_solid(solids, last.y >> 16u);
    let n = rows(u, low, high, last.x);
    var motion: Rows;
    if (DAMPED || SHOCKED) { motion = rows(v, low, high, last.x); }
    var sum = Rows();
    for (var i = 0u; i < thin.z; i += 4u) {
        let a = texel(places, thin.y + i);
        let b = texel(places, thin.y + i + 1u);
        let c = texel(places, thin.y + i + 2u);
        let d = texel(places, thin.y + i + 3u);
        let wa = weights(a.xyz);
        let wb = weights(b.xyz);
        let wc = weights(c.xyz);
        let wd = weights(d.xyz);
        let share = vec4f(a.w, b.w, c.w, d.w);
        let f = all_deformed(Four(derivatives(n, wa), derivatives(n, wb), derivatives(n, wc), derivatives(n, wd)));
        var p = stress(solid, f, share);
        if (DAMPED || SHOCKED) {
            p = viscous(solid, p, f, Four(derivatives(motion, wa), derivatives(motion, wb), derivatives(motion, wc),
                derivatives(motion, wd)), share);
        }
        sum = spread(spread(spread(spread(sum, p.a, wa), p.b, wb), p.c, wc), p.d, wd);
    }
    put(last.w, 0u, sum.a);
    put(last.w, 1u, sum.b);
    put(last.w, 2u, sum.c);
    put(last.w, 3u, sum.d);
    put(last.w, 4u, sum.e);
    put(last.w, 5u, sum.f);
    put(last.w, 6u, sum.g);
    put(last.w, 7u, sum.h);
    put(last.w, 8u, sum.i);
    tell_clock(solid);
}

//! use lib/stress
// Forces of each cell on its 27 nodes, f = −Σ V0 P(F) ∇N with F = I + Σ u ⊗ ∇N at its points, and what pushes their
// surface: Σ N f. One lane a cell; sums go axis by axis, down to the points and back up.
// A cell of eight points: 33 loads (27 of them displacements), 27 stores of four words, some 3600 operations; one that
// may be pushed 56 loads more, and one that is damped, or may meet a shock, 27 and its points' rates. On a software
// driver 25 ns of processor time a point of a cube of 37³, where it was 46: of those 10 are stores, 1 loads, 14
// arithmetic; 37 for 28 where shocks may be met. What helped: four polar decompositions at once (10 ns), pushes in a
// call of their own (6), as many lanes as cells (8). What did not: 12 bytes a store for 16; three steps of third order
// for ten of Newton (9, but not exact where a point is inside out) and leaving either early point by point (5).
//! texels cells: ElasticCell
//! texels solids: Solid
//! texels u: vec4f
//! texels v: vec4f
//! texels pushes: vec4f

// The cells that something may push, in a call of their own: a software driver spends on a branch whether or not it is
// taken, and most cells have no surface.
override PUSHED: bool = true;

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var cells: texture_1d<u32>;
@group(0) @binding(1) var solids: texture_1d<u32>;
@group(0) @binding(2) var u: texture_1d<u32>;           // displacement of the nodes [m]
@group(0) @binding(3) var pushes: texture_1d<u32>;      // four a point at the surface, see `contact`
@group(0) @binding(4) var<storage, read_write> shares: Vectors;     // node 0 of every cell, node 1 of every cell, …
@group(0) @binding(5) var<storage, read_write> clock: Clock;
@group(0) @binding(6) var v: texture_1d<u32>;           // velocity of the nodes [m/s]
var<immediate> reference: Reference;

// At the lower and at the upper quarter of a cell.
struct Two { a: vec3f, b: vec3f }
// At the nodes below, at and above a cell.
struct Three { l: vec3f, m: vec3f, r: vec3f }

fn values(n: Three) -> Two {
    let even = 0.6875 * n.m + 0.15625 * (n.l + n.r);
    let odd = 0.125 * (n.r - n.l);
    return Two(even - odd, even + odd);
}

fn slopes(n: Three) -> Two {
    let odd = 0.5 * (n.r - n.l);
    let even = 0.25 * (n.l + n.r) - 0.5 * n.m;
    return Two(odd - even, odd + even);
}

// The way back, transposed.
fn spread_values(p: Two) -> Three {
    let s = 0.15625 * (p.a + p.b);
    let d = 0.125 * (p.b - p.a);
    return Three(s - d, 0.6875 * (p.a + p.b), s + d);
}

fn spread_slopes(p: Two) -> Three {
    let s = 0.5 * (p.a + p.b);
    let d = 0.25 * (p.b - p.a);
    return Three(d - s, -2.0 * d, d + s);
}

fn add(p: Three, q: Three) -> Three {
    return Three(p.l + q.l, p.m + q.m, p.r + q.r);
}

// Along x done: values and slopes.
struct Line { v: Two, x: Two }

fn line(t: texture_1d<u32>, first: u32) -> Line {
    let n = Three(texel(t, first).xyz, texel(t, first + 1u).xyz, texel(t, first + 2u).xyz);
    return Line(values(n), slopes(n));
}

// Along x and y done; the first letter is what, the second where along x.
struct Layer { va: Two, vb: Two, xa: Two, xb: Two, ya: Two, yb: Two }

fn layer(t: texture_1d<u32>, rows: vec3u) -> Layer {
    let l = line(t, rows.x);
    let m = line(t, rows.y);
    let r = line(t, rows.z);
    let a = Three(l.v.a, m.v.a, r.v.a);
    let b = Three(l.v.b, m.v.b, r.v.b);
    return Layer(values(a), values(b), values(Three(l.x.a, m.x.a, r.x.a)), values(Three(l.x.b, m.x.b, r.x.b)),
        slopes(a), slopes(b));
}

// What the two points of a column along z give to its three layers: by ∇N along x, along y, and the rest.
struct Column { x: Three, y: Three, v: Three }

// Texel `which` of what pushes a point: 0 the point itself, 1, 2, 3 its faces along x, y, z.
fn push(mask: u32, skin: u32, corner: u32, which: u32) -> vec4f {
    if (((mask >> (8u + corner)) & 1u) == 0u) { return vec4f(0.0); }
    return texel(pushes, 4u * (skin + countOneBits((mask >> 8u) & ((1u << corner) - 1u))) + which);
}

// A force f on a face d cells above its point reaches the nodes by N + d N' + d²/2 N″ of the point, d² = 1/16; and
// N″ = 2 (N'(1/4) − N'(−1/4)) in cells. So each face adds to the two points along its axis in the place of stress.
struct Pushed { f: vec3f, p: mat3x3f }

fn pushed(mask: u32, skin: u32, corner: u32) -> Pushed {
    let own = push(mask, skin, corner, 0u).xyz;
    let x = push(mask, skin, corner, 1u);
    let y = push(mask, skin, corner, 2u);
    let z = push(mask, skin, corner, 3u);
    let bend_x = (x.xyz + push(mask, skin, corner ^ 1u, 1u).xyz) * select(-0.0625, 0.0625, (corner & 1u) != 0u);
    let bend_y = (y.xyz + push(mask, skin, corner ^ 2u, 2u).xyz) * select(-0.0625, 0.0625, (corner & 2u) != 0u);
    let bend_z = (z.xyz + push(mask, skin, corner ^ 4u, 3u).xyz) * select(-0.0625, 0.0625, (corner & 4u) != 0u);
    return Pushed(own + x.xyz + y.xyz + z.xyz, mat3x3f(x.w * x.xyz + bend_x, y.w * y.xyz + bend_y, z.w * z.xyz + bend_z));
}

// One column from what its two points got.
fn column(p: mat3x3f, q: mat3x3f, mask: u32, skin: u32, corner: u32) -> Column {
    var low = p;
    var high = q;
    var f = Two(vec3f(0.0), vec3f(0.0));
    if (PUSHED) {
        let a = pushed(mask, skin, corner);
        let b = pushed(mask, skin, corner + 4u);
        low += a.p;
        high += b.p;
        f = Two(a.f, b.f);
    }
    return Column(spread_values(Two(low[0], high[0])), spread_values(Two(low[1], high[1])),
        add(spread_slopes(Two(low[2], high[2])), spread_values(f)));
}

struct Columns { a: Column, b: Column }

// Two columns side by side along x: a field and its slopes along x and y in their three layers.
struct Pair { va: Three, xa: Three, ya: Three, vb: Three, xb: Three, yb: Three }

fn near(l: Layer, m: Layer, r: Layer) -> Pair {
    return Pair(Three(l.va.a, m.va.a, r.va.a), Three(l.xa.a, m.xa.a, r.xa.a), Three(l.ya.a, m.ya.a, r.ya.a),
        Three(l.vb.a, m.vb.a, r.vb.a), Three(l.xb.a, m.xb.a, r.xb.a), Three(l.yb.a, m.yb.a, r.yb.a));
}

fn far(l: Layer, m: Layer, r: Layer) -> Pair {
    return Pair(Three(l.va.b, m.va.b, r.va.b), Three(l.xa.b, m.xa.b, r.xa.b), Three(l.ya.b, m.ya.b, r.ya.b),
        Three(l.vb.b, m.vb.b, r.vb.b), Three(l.xb.b, m.xb.b, r.xb.b), Three(l.yb.b, m.yb.b, r.yb.b));
}

// Derivatives at their four points: low a, low b, high a, high b.
fn derivatives(p: Pair) -> Four {
    let fxa = values(p.xa);
    let fya = values(p.ya);
    let fza = slopes(p.va);
    let fxb = values(p.xb);
    let fyb = values(p.yb);
    let fzb = slopes(p.vb);
    return Four(slope(fxa.a, fya.a, fza.a), slope(fxb.a, fyb.a, fzb.a), slope(fxa.b, fya.b, fza.b),
        slope(fxb.b, fyb.b, fzb.b));
}

// Two columns from displacement and velocity.
fn columns(solid: Solid, place: Pair, motion: Pair, mask: u32, skin: u32, corner: u32) -> Columns {
    let exists = (vec4u(mask >> corner) & vec4u(1u, 2u, 16u, 32u)) != vec4u(0u);
    let share = select(vec4f(0.0), vec4f(1.0), exists);
    let f = all_deformed(derivatives(place));
    var p = stress(solid, f, share);
    if (DAMPED || SHOCKED) { p = viscous(solid, p, f, derivatives(motion), share); }
    return Columns(column(p.a, p.c, mask, skin, corner), column(p.b, p.d, mask, skin, corner + 1u));
}

// One row of nodes: what its two ends along x got.
fn put_row(to: u32, x: Two, v: Two) {
    let n = add(spread_slopes(x), spread_values(v));
    let cells = reference.cells;
    shares.d[to] = vec4f(n.l, 0.0);
    shares.d[to + cells] = vec4f(n.m, 0.0);
    shares.d[to + 2u * cells] = vec4f(n.r, 0.0);
}

// One layer of nodes from the four columns; the first letter is where along x, the second along y.
fn put_layer(to: u32, xaa: vec3f, xab: vec3f, xba: vec3f, xbb: vec3f, yaa: vec3f, yab: vec3f, yba: vec3f, ybb: vec3f,
    vaa: vec3f, vab: vec3f, vba: vec3f, vbb: vec3f) {
    let xa = spread_values(Two(xaa, xab));
    let xb = spread_values(Two(xba, xbb));
    let va = add(spread_slopes(Two(yaa, yab)), spread_values(Two(vaa, vab)));
    let vb = add(spread_slopes(Two(yba, ybb)), spread_values(Two(vba, vbb)));
    put_row(to, Two(xa.l, xb.l), Two(va.l, vb.l));
    put_row(to + 3u * reference.cells, Two(xa.m, xb.m), Two(va.m, vb.m));
    put_row(to + 6u * reference.cells, Two(xa.r, xb.r), Two(va.r, vb.r));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let i = id.x + select(reference.touched, 0u, PUSHED);
    if (i >= select(reference.cells, reference.touched, PUSHED)) { return; }
    let low = textureLoad(cells, 3u * i, 0);
    let high = textureLoad(cells, 3u * i + 1u, 0);
    let last = textureLoad(cells, 3u * i + 2u, 0);
    let mask = last.y;
    let solid = load_solid(solids, mask >> 16u);
    let l = layer(u, low.xyz);
    let m = layer(u, vec3u(low.w, high.xy));
    let r = layer(u, vec3u(high.zw, last.x));
    var vl: Layer;
    var vm: Layer;
    var vr: Layer;
    if (DAMPED || SHOCKED) {
        vl = layer(v, low.xyz);
        vm = layer(v, vec3u(low.w, high.xy));
        vr = layer(v, vec3u(high.zw, last.x));
    }
    let front = columns(solid, near(l, m, r), near(vl, vm, vr), mask, last.z, 0u);
    let back = columns(solid, far(l, m, r), far(vl, vm, vr), mask, last.z, 2u);
    let aa = front.a;
    let ba = front.b;
    let ab = back.a;
    let bb = back.b;
    let to = last.w;
    put_layer(to, aa.x.l, ab.x.l, ba.x.l, bb.x.l, aa.y.l, ab.y.l, ba.y.l, bb.y.l, aa.v.l, ab.v.l, ba.v.l, bb.v.l);
    put_layer(to + 9u * reference.cells, aa.x.m, ab.x.m, ba.x.m, bb.x.m, aa.y.m, ab.y.m, ba.y.m, bb.y.m, aa.v.m, ab.v.m, ba.v.m, bb.v.m);
    put_layer(to + 18u * reference.cells, aa.x.r, ab.x.r, ba.x.r, bb.x.r, aa.y.r, ab.y.r, ba.y.r, bb.y.r, aa.v.r, ab.v.r, ba.v.r, bb.v.r);
    tell_clock(solid);
}

//! use lib/deformed lib/bspline
// A field on the 27 nodes of a cell, and its derivatives at any place of that.

// The nodes of a row along x.
struct Row { l: vec3f, m: vec3f, r: vec3f }
// Nine rows, y faster than z.
struct Rows { a: Row, b: Row, c: Row, d: Row, e: Row, f: Row, g: Row, h: Row, i: Row }

fn load(t: texture_1d<u32>, first: u32, step: u32) -> Row {
    return Row(texel(t, first).xyz, texel(t, first + step).xyz, texel(t, first + 2u * step).xyz);
}

fn rows(t: texture_1d<u32>, low: vec4u, high: vec4u, last: u32) -> Rows {
    return Rows(load(t, low.x, 1u), load(t, low.y, 1u), load(t, low.z, 1u), load(t, low.w, 1u), load(t, high.x, 1u),
        load(t, high.y, 1u), load(t, high.z, 1u), load(t, high.w, 1u), load(t, last, 1u));
}

// Value and derivative along x of a row.
struct Sum2 { v: vec3f, x: vec3f }

fn along(r: Row, w: vec3f, g: vec3f) -> Sum2 {
    return Sum2(w.x * r.l + w.y * r.m + w.z * r.r, g.x * r.l + g.y * r.m + g.z * r.r);
}

// Weights of a place along each axis, and their slopes a cell.
struct Weights { wx: vec3f, wy: vec3f, wz: vec3f, gx: vec3f, gy: vec3f, gz: vec3f }

fn weights(x: vec3f) -> Weights {
    let f = x + 1.0;
    return Weights(bspline(f.x), bspline(f.y), bspline(f.z), bspline_slope(f.x), bspline_slope(f.y), bspline_slope(f.z));
}

// Derivatives along x, y and z of three rows in one layer, the last still to be weighted along z.
struct Layer { x: vec3f, y: vec3f, v: vec3f }

fn flat(a: Row, b: Row, c: Row, w: Weights) -> Layer {
    let p = along(a, w.wx, w.gx);
    let q = along(b, w.wx, w.gx);
    let r = along(c, w.wx, w.gx);
    return Layer(w.wy.x * p.x + w.wy.y * q.x + w.wy.z * r.x, w.gy.x * p.v + w.gy.y * q.v + w.gy.z * r.v,
        w.wy.x * p.v + w.wy.y * q.v + w.wy.z * r.v);
}

fn derivatives(n: Rows, w: Weights) -> mat3x3f {
    let l = flat(n.a, n.b, n.c, w);
    let m = flat(n.d, n.e, n.f, w);
    let r = flat(n.g, n.h, n.i, w);
    return slope(w.wz.x * l.x + w.wz.y * m.x + w.wz.z * r.x, w.wz.x * l.y + w.wz.y * m.y + w.wz.z * r.y,
        w.gz.x * l.v + w.gz.y * m.v + w.gz.z * r.v);
}

//! use lib/texel lib/particle
// Bodies on grids of their own, at rest: nodes at the middles of cells, quadratic B-splines between them, eight points a
// cell at its quarters. All eight reach the same 27 nodes by two sets of weights an axis.

// Share of its volume at rest below which a point counts as squeezed flat.
override LEAST_VOLUME: f32 = 0.05;

// A matrix at each of four points.
struct Four { a: mat3x3f, b: mat3x3f, c: mat3x3f, d: mat3x3f }

// What a hyperelastic material answers for four points.
struct Piola {
    p: Four,        // first Piola–Kirchhoff stress [Pa]
    stiff: vec4f,   // its largest derivative along a direction, as a bound: λ + 2μ at rest [Pa]
}

// Square of the largest singular value of a cofactor from the sum of all three, as a bound: exact where the other two
// are 1.
fn widest(sum: vec4f) -> vec4f {
    return max(vec4f(1.0), sum - 2.0);
}

// Sizes of a call.
struct Reference {
    dx: f32,        // [m]
    nodes: u32,
    cells: u32,
    skins: u32,     // points at the surface
    points: u32,
    thin: u32,      // cells with thin parts
    touched: u32,   // cells with points at the surface that something may push: those come first
}

// A cell that holds free points.
struct ElasticCell {
    rows: array<u32, 9>,    // first of the three nodes of each row along x; y faster than z
    mask: u32,              // bits 0–7: its points (corner x + 2 y + 4 z) but the thin ones, 8–15: those at the surface, from 16 on: the body
    skin: u32,              // the first of those at the surface
    slot: u32,              // its number in the order of places, x fastest: where its shares are, and what rows count
}

// A cell with thin parts, and what integrates those: places from `first` on, a multiple of four of them. In bits 0–7 of
// `points` which of its points they stand for.
struct ThinCell { cell: u32, first: u32, count: u32, points: u32 }

// A quadrature point [cells from the middle of its cell], and its share of a particle's volume; 0: none.
struct Place { x: vec3f, share: f32 }

// A node of a body.
struct ElasticNode {
    x: vec3f,               // where it rests [m]
    tag: u32,               // body, and the flag below
    m: f32,                 // lumped mass Σ m N, that of its mirror image included [kg]
    mirror: u32,            // node behind a clamp that moves by the opposite, or NOBODY
    // Cells around it, a row along x each: in bits 0–2 which of the three exist, above them the slot of the first.
    rows: array<u32, 9>,
    spare: u32,
}
const HELD: u32 = 0x40000000u;      // does not move by itself
const NOBODY: u32 = 0xffffffffu;

// What the bodies are made of.
struct Solid {
    material: u32,
    fields: u32,        // as in `Body`
    mu: f32,            // [Pa]
    lambda: f32,
    volume: f32,        // of a point [m³]
    stiffness: f32,     // of contact: pressure for a depth [Pa/m]
    wave: f32,          // fastest elastic wave [m/s]
    damping: f32,       // β [s]: stress gains β times its rate
    gravity: vec3f,     // [m/s²]
    density: f32,       // at rest [kg/m³]
}

// A point at the surface, at rest.
struct Skin {
    x: vec3f,           // [m]
    point: u32,         // cell · 8 + corner
    normal: vec3f,      // outward, smooth; zero where there is none
    tag: u32,           // body; in bits 8–13 which faces have no neighbour: −x, −y, −z, x, y, z
}

// Where a particle rests [m], and its cell · 8 + corner; NOBODY if it is held.
struct Rest { x: vec3f, point: u32 }

fn load_solid(t: texture_1d<u32>, i: u32) -> Solid {
    let a = textureLoad(t, 3u * i, 0);
    let b = textureLoad(t, 3u * i + 1u, 0);
    let c = bitcast<vec4f>(b);
    let d = texel(t, 3u * i + 2u);
    return Solid(a.x, a.y, bitcast<f32>(a.z), bitcast<f32>(a.w), c.x, c.y, c.z, c.w, d.xyz, d.w);
}

// A sum over the nodes of a cell at one of its points: the value, its derivatives by x, y, z a cell, and the second
// derivative along each.
struct Sum { v: vec3f, x: vec3f, y: vec3f, z: vec3f, xx: vec3f, yy: vec3f, zz: vec3f }

// Weights and slopes at +1/4 of the nodes below, at and above the cell; at −1/4 they come in the other order.
const WEIGHT: vec3f = vec3f(0.03125, 0.6875, 0.28125);
const SLOPE: vec3f = vec3f(-0.25, -0.5, 0.75);

fn blend(l: vec3f, m: vec3f, r: vec3f, w: vec3f) -> vec3f {
    return w.x * l + w.y * m + w.z * r;
}

struct RowSum { v: vec3f, x: vec3f, xx: vec3f }

fn sum_row(t: texture_1d<u32>, first: u32, w: vec3f, g: vec3f) -> RowSum {
    let l = texel(t, first).xyz;
    let m = texel(t, first + 1u).xyz;
    let r = texel(t, first + 2u).xyz;
    return RowSum(blend(l, m, r, w), blend(l, m, r, g), l - 2.0 * m + r);
}

struct LayerSum { v: vec3f, x: vec3f, y: vec3f, xx: vec3f, yy: vec3f }

// Three rows, one above the other along y.
fn sum_layer(t: texture_1d<u32>, rows: vec3u, wx: vec3f, gx: vec3f, wy: vec3f, gy: vec3f) -> LayerSum {
    let a = sum_row(t, rows.x, wx, gx);
    let b = sum_row(t, rows.y, wx, gx);
    let c = sum_row(t, rows.z, wx, gx);
    return LayerSum(blend(a.v, b.v, c.v, wy), blend(a.x, b.x, c.x, wy), blend(a.v, b.v, c.v, gy),
        blend(a.xx, b.xx, c.xx, wy), a.v - 2.0 * b.v + c.v);
}

// A field on the nodes at point cell · 8 + corner.
fn sum_at(cells: texture_1d<u32>, t: texture_1d<u32>, point: u32) -> Sum {
    let at = 3u * (point >> 3u);
    let low = textureLoad(cells, at, 0);
    let high = textureLoad(cells, at + 1u, 0);
    let last = textureLoad(cells, at + 2u, 0).x;
    let upper = (vec3u(point) & vec3u(1u, 2u, 4u)) != vec3u(0u);
    let wx = select(WEIGHT.zyx, WEIGHT, upper.x);
    let wy = select(WEIGHT.zyx, WEIGHT, upper.y);
    let wz = select(WEIGHT.zyx, WEIGHT, upper.z);
    let gx = select(-SLOPE.zyx, SLOPE, upper.x);
    let gy = select(-SLOPE.zyx, SLOPE, upper.y);
    let gz = select(-SLOPE.zyx, SLOPE, upper.z);
    let a = sum_layer(t, low.xyz, wx, gx, wy, gy);
    let b = sum_layer(t, vec3u(low.w, high.xy), wx, gx, wy, gy);
    let c = sum_layer(t, vec3u(high.zw, last), wx, gx, wy, gy);
    return Sum(blend(a.v, b.v, c.v, wz), blend(a.x, b.x, c.x, wz), blend(a.y, b.y, c.y, wz), blend(a.v, b.v, c.v, gz),
        blend(a.xx, b.xx, c.xx, wz), blend(a.yy, b.yy, c.yy, wz), a.v - 2.0 * b.v + c.v);
}

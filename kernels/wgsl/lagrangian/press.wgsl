//! use lib/polar lib/facet lib/bspline lib/clock lib/grid
// Contact of bodies on grids of their own with the matter of the shared grid: a pressure for how much of that lies where a
// body is, and a spring along the surface that slips by Coulomb's law. A field of mass smoothed twice by the B-spline
// falls from the density to nothing over about two cells, one half at a flat surface; of the body itself the same smoothing
// leaves `room` at each facet, and what is more than that overlaps. What a facet gets, the nodes around it lose, by the
// mass that they have: in whole units, so that the order in which lanes come does not matter. One lane a facet.
// Per facet 134 loads, some 900 operations; one that is pressed 27 loads and 81 atomics besides.
//! texels cells: ElasticCell
//! texels facets: Facet
//! texels u: vec4f
//! texels v: vec4f
//! texels table: u32
//! texels nodes: vec4f
//! texels touches_was: Touch

// Something has pushed already.
override BESIDE: bool = false;
// Of the grid's matter: density [kg/m³], stiffness of contact [Pa/m], Coulomb's coefficient.
override DENSITY: f32 = 1000.0;
override STIFFNESS: f32 = 1e6;
override FRICTION: f32 = 0.0;
// What one step of the sums stands for [kg m/s].
override UNIT: f32 = 1e-9;

// Slope of the twice smoothed step at its middle, a cell: the quintic B-spline's value at 0.
const SLOPE_OF_FILL: f32 = 0.55;
// No node counts for more than this many times the density: what is held has a mass beyond all others'.
const FULLEST: f32 = 2.0;
// From this share of the density on there is something to meet.
const LEAST: f32 = 0.02;

struct Vectors { d: array<vec4f> }
struct Touches { d: array<Touch> }
struct Sums3 { d: array<atomic<i32>> }
@group(0) @binding(0) var cells: texture_1d<u32>;
@group(0) @binding(1) var facets: texture_1d<u32>;
@group(0) @binding(2) var u: texture_1d<u32>;
@group(0) @binding(3) var v: texture_1d<u32>;
@group(0) @binding(4) var table: texture_1d<u32>;           // slot + 1 of each block of the grid
@group(0) @binding(5) var nodes: texture_1d<u32>;           // of the grid: velocity, and in w mass
@group(0) @binding(6) var touches_was: texture_1d<u32>;     // the same buffer, read and then written by its lane
@group(0) @binding(7) var<storage, read_write> touches: Touches;
@group(0) @binding(8) var<storage, read_write> pushes: Vectors;     // see `contact`
@group(0) @binding(9) var<storage, read_write> gifts: Sums3;        // three a node: impulse in units
@group(0) @binding(10) var<storage, read_write> clock: Clock;
var<immediate> grid: Grid;

// A field's value `way` cells along an axis from a point: exact, since the weights are quadratic.
fn beside(s: Sum, axis: u32, way: f32) -> vec3f {
    let slope = select(select(s.x, s.y, axis == 1u), s.z, axis == 2u);
    let bend = select(select(s.xx, s.yy, axis == 1u), s.zz, axis == 2u);
    return s.v + way * slope + (0.5 * way * way) * bend;
}

// Slots of the blocks that the nodes around a place lie in: its own and those above along x, y, xy, and the same above in z.
struct Around { low: vec4u, high: vec4u, first: vec3u }

fn slot_of(block: vec3u) -> u32 {
    // What is not active has no slot; nor has what found no room.
    let at = block_index(grid, min(block, grid.blocks - vec3u(1u)));
    let slot = word(table, at) - 1u;
    return select(NOWHERE, slot, all(block < grid.blocks) && slot < grid.capacity);
}

fn around(base: vec3u) -> Around {
    let b = base >> vec3u(2u);
    let low = vec4u(slot_of(b), slot_of(b + vec3u(1u, 0u, 0u)), slot_of(b + vec3u(0u, 1u, 0u)), slot_of(b + vec3u(1u, 1u, 0u)));
    let up = b + vec3u(0u, 0u, 1u);
    let high = vec4u(slot_of(up), slot_of(up + vec3u(1u, 0u, 0u)), slot_of(up + vec3u(0u, 1u, 0u)), slot_of(up + vec3u(1u, 1u, 0u)));
    return Around(low, high, base & vec3u(3u));
}

// Number of a node, o from the first; NOWHERE where there is none.
fn number(a: Around, o: vec3u) -> u32 {
    let at = a.first + o;
    let layer = select(a.low, a.high, at.z > 3u);
    let pair = select(layer.xy, layer.zw, at.y > 3u);
    let slot = select(pair.x, pair.y, at.x > 3u);
    return select(slot * 64u + (at.z & 3u) * 16u + (at.y & 3u) * 4u + (at.x & 3u), NOWHERE, slot == NOWHERE);
}

fn node_at(i: u32) -> vec4f {
    let n = texel(nodes, min(i, grid.capacity * 64u - 1u));
    return select(vec4f(0.0), n, i != NOWHERE);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let dt = clock.dt;
    let waves = clock.wave_speed;
    let i = id.x;
    if (i >= grid.count) { return; }
    let head = texel(facets, 3u * i);
    let shape = texel(facets, 3u * i + 1u);
    let law = texel(facets, 3u * i + 2u);
    let stored = texel(touches_was, 2u * i).w;
    let was = texel(touches_was, 2u * i + 1u);
    let point = bitcast<u32>(head.w);
    let tag = bitcast<u32>(shape.w);
    if ((tag & NO_FACET) != 0u) { return; }
    let axis = (tag >> 8u) & 3u;
    let way = select(-0.25, 0.25, (tag & 0x400u) != 0u);
    let face = 0.25 * grid.dx * grid.dx;
    var x = head.xyz;
    var speed = vec3f(0.0);
    var cof = mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
    if (point != NOBODY) {
        let moved = sum_at(cells, u, point);
        x += beside(moved, axis, way);
        speed = beside(sum_at(cells, v, point), axis, way);
        let inv = 1.0 / grid.dx;
        cof = cofactor(mat3x3f(vec3f(1.0, 0.0, 0.0) + inv * moved.x, vec3f(0.0, 1.0, 0.0) + inv * moved.y,
            vec3f(0.0, 0.0, 1.0) + inv * moved.z));
    }
    let side = select(select(cof[0], cof[1], axis == 1u), cof[2], axis == 2u);
    let long = length(side);
    let outward = side * (sign(way) / max(long, 1e-20));
    // A stretched face counts as it was at rest, as it does to obstacles.
    let area = face * min(long, 1.0);
    // Outside the grid there is nothing to meet, nor where it is no place.
    let there = finite(x) && finite(speed) && inside(grid, base_node(grid, x));
    let n = select(vec3f(0.0), outward, there);
    let base = select(vec3f(0.0), base_node(grid, x), there);
    let f = select(vec3f(1.0), (x - grid.origin) / grid.dx - base, there);
    let wx = bspline(f.x);
    let wy = bspline(f.y);
    let wz = bspline(f.z);
    let a = around(vec3u(base));
    let full = DENSITY * grid.dx * grid.dx * grid.dx;
    let gx = bspline_slope(f.x);
    let gy = bspline_slope(f.y);
    let gz = bspline_slope(f.z);
    var fill = 0.0;
    var slope = vec3f(0.0);     // of `fill` a cell
    var mass = 0.0;
    var momentum = vec3f(0.0);
    for (var k = 0u; k < 3u; k++) {
        for (var j = 0u; j < 3u; j++) {
            let w = wz[k] * wy[j];
            let p = node_at(number(a, vec3u(0u, j, k)));
            let q = node_at(number(a, vec3u(1u, j, k)));
            let r = node_at(number(a, vec3u(2u, j, k)));
            let m = (w * wx) * vec3f(p.w, q.w, r.w);
            let some = min(vec3f(p.w, q.w, r.w), vec3f(FULLEST * full));
            fill += w * dot(wx, some);
            slope += vec3f(w * dot(gx, some), wz[k] * gy[j] * dot(wx, some), gz[k] * wy[j] * dot(wx, some));
            mass += m.x + m.y + m.z;
            momentum += m.x * p.xyz + m.y * q.xyz + m.z * r.xyz;
        }
    }
    fill = select(0.0, fill / full, there);
    let depth = select(0.0, max(0.0, fill - bitcast<f32>(law.w)) * grid.dx / SLOPE_OF_FILL, mass > 0.0 && there);
    let rate = select(vec3f(0.0), speed - momentum / max(mass, 1e-30), mass > 0.0 && there);
    // A sheet is met from both sides by its one face: the denser side pushes.
    let steep = clamp(dot(slope, n) / (SLOPE_OF_FILL * full), -1.0, 1.0);
    let against = select(1.0, steep, (tag & SHEET) != 0u);
    // Two springs in a row.
    let k = select(0.0, area * law.x * STIFFNESS / (law.x + STIFFNESS), there);
    let slid = was.xyz + was.w * rate;
    let across = slid - dot(slid, n) * n;
    let most = min(law.y, FRICTION) * depth;
    let kept = select(vec3f(0.0), across * min(1.0, most / max(length(across), 1e-30)), depth > 0.0);
    let force = -k * (depth * against * n + kept);
    // Nodes of bodies are kicked by half of the last step and half of this one.
    let kick = 0.5 * (was.w + dt);
    let closing = against * dot(rate, n);
    // The work it has taken, and no more than a spring of that depth holds.
    let energy = clamp(stored + kick * k * depth * closing, 0.0, 0.5 * k * depth * depth);
    touches.d[i] = Touch(force, energy, kept, dt);
    let push = bitcast<u32>(law.z);
    if (push != NOBODY) {
        let to = push + 1u + axis;
        var all_of_it = force;
        if (BESIDE) { all_of_it += pushes.d[to].xyz; }
        pushes.d[to] = vec4f(all_of_it, way);
    }
    let given = force * (-kick / (max(mass, 1e-30) * UNIT));
    for (var o = 0u; o < select(0u, 27u, depth > 0.0); o++) {
        let at = vec3u(o % 3u, (o / 3u) % 3u, o / 9u);
        let which = number(a, at);
        let m = node_at(which).w * wx[at.x] * wy[at.y] * wz[at.z];
        if (m > 0.0) {
            let part = vec3i(round(clamp(m * given, vec3f(-2.68435456e8), vec3f(2.68435456e8))));
            atomicAdd(&gifts.d[3u * which], part.x);
            atomicAdd(&gifts.d[3u * which + 1u], part.y);
            atomicAdd(&gifts.d[3u * which + 2u], part.z);
        }
    }
    // What comes together fast shortens the next step, so that it does not begin deep inside.
    if (fill > LEAST && closing > 0.0) { atomicMax(&clock.speed_bits, bitcast<u32>(waves + closing)); }
}

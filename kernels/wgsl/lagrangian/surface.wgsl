//! use lib/polar lib/facet
// Where the surface is, how it is turned and how far it has come since the last step; and the bounds of each group of
// facets. One lane a facet, one workgroup a group.
//! texels cells: ElasticCell
//! texels facets: Facet
//! texels solids: Solid
//! texels u: vec4f
//! texels v: vec4f
//! texels ties: Tie

struct Patches { d: array<Patch> }
struct AllBounds { d: array<Bounds> }
@group(0) @binding(0) var cells: texture_1d<u32>;
@group(0) @binding(1) var facets: texture_1d<u32>;
@group(0) @binding(2) var u: texture_1d<u32>;
@group(0) @binding(3) var v: texture_1d<u32>;
@group(0) @binding(4) var ties: texture_1d<u32>;
@group(0) @binding(5) var<storage, read_write> patches: Patches;
@group(0) @binding(6) var<storage, read_write> bounds: AllBounds;
@group(0) @binding(7) var solids: texture_1d<u32>;
var<immediate> surface: Surface;

// Where what is no facet lies [m].
const AWAY: f32 = 1e15;

var<workgroup> places: array<vec3f, FACETS>;
var<workgroup> speeds: array<vec3f, FACETS>;
var<workgroup> there: array<u32, FACETS>;

// A field's value `way` cells along an axis from a point: exact, since the weights are quadratic.
fn beside(s: Sum, axis: u32, way: f32) -> vec3f {
    let slope = select(select(s.x, s.y, axis == 1u), s.z, axis == 2u);
    let bend = select(select(s.xx, s.yy, axis == 1u), s.zz, axis == 2u);
    return s.v + way * slope + (0.5 * way * way) * bend;
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let first = group.x * FACETS;
    if (first >= surface.facets) { return; }
    let i = first + lane;
    let head = texel(facets, 3u * i);
    let shape = texel(facets, 3u * i + 1u);
    let law = texel(facets, 3u * i + 2u);
    let tie = texel(ties, 2u * i);
    let last = texel(ties, 2u * i + 1u);
    let point = bitcast<u32>(head.w);
    let solid = load_solid(solids, bitcast<u32>(shape.w) & BODY_MASK);
    let tag = bitcast<u32>(shape.w);
    let axis = (tag >> 8u) & 3u;
    let way = select(-0.25, 0.25, (tag & 0x400u) != 0u);
    let face = 0.25 * surface.dx * surface.dx;
    var x = head.xyz;
    var speed = vec3f(0.0);
    var normal = shape.xyz;
    var area = vec3f(0.0);
    if ((tag & NO_FACET) != 0u) {
        x = vec3f(AWAY);
    } else {
        var cof = mat3x3f(1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0);
        if (point != NOBODY) {
            let moved = sum_at(cells, u, point);
            x += beside(moved, axis, way);
            speed = beside(sum_at(cells, v, point), axis, way);
            let inv = 1.0 / surface.dx;
            cof = cofactor(mat3x3f(vec3f(1.0, 0.0, 0.0) + inv * moved.x, vec3f(0.0, 1.0, 0.0) + inv * moved.y,
                vec3f(0.0, 0.0, 1.0) + inv * moved.z));
        }
        let turned = cof * shape.xyz;
        normal = turned / max(length(turned), 1e-20);
        area = (4.0 * way * face) * select(select(cof[0], cof[1], axis == 1u), cof[2], axis == 2u);
    }
    let moved = select(vec3f(0.0), x - last.xyz, last.w > 0.0);
    patches.d[i] = Patch(x, tag, normal, law.x, area, law.y, 0.5 * tie.xyz + moved, bitcast<u32>(law.z),
        speed, sqrt(solid.density), select(FIRST * surface.dx, last.w, last.w > 0.0), solid.wave, solid.damping, 0u);
    places[lane] = x;
    speeds[lane] = speed;
    there[lane] = select(1u, 0u, (tag & NO_FACET) != 0u);
    workgroupBarrier();
    // The first of a group is always a facet.
    if (lane == 0u) {
        var low = places[0];
        var high = low;
        for (var k = 1u; k < FACETS; k++) {
            low = select(low, min(low, places[k]), there[k] != 0u);
            high = select(high, max(high, places[k]), there[k] != 0u);
        }
        bounds.d[group.x].low = low;
        bounds.d[group.x].high = high;
        bounds.d[group.x].body = tag & BODY_MASK;
    }
    if (lane == 1u) {
        var slowest = speeds[0];
        var fastest = slowest;
        for (var k = 1u; k < FACETS; k++) {
            slowest = select(slowest, min(slowest, speeds[k]), there[k] != 0u);
            fastest = select(fastest, max(fastest, speeds[k]), there[k] != 0u);
        }
        bounds.d[group.x].slowest = slowest;
        bounds.d[group.x].fastest = fastest;
    }
}

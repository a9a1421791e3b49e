//! use lib/clock lib/facet lib/shock lib/give
// Contact of bodies with each other, facet by facet of two bodies that face each other: a pressure for the depth, that
// of a shock, and a spring along the surface that slips by Coulomb's law. Each pair pushes both of its facets by the
// same force: it is made of the two areas and of a weight W of their distance along the surface, whose sum times the
// areas around a place is one. The other is found by the bounds of its group of 64. One lane a facet, one workgroup a
// group.
//! texels patches: Patch
//! texels bounds: Bounds

// Obstacles have pushed already.
override BESIDE: bool = false;
// Depth at which the pressure has doubled by its part with the fifth power, in cells.
override FIRM: f32 = 0.25;
// Up to which it begins softly, see `give`.
override SOFT: f32 = 0.03;

struct Vectors { d: array<vec4f> }
struct Ties { d: array<Tie> }
@group(0) @binding(0) var patches: texture_1d<u32>;
@group(0) @binding(1) var bounds: texture_1d<u32>;
@group(0) @binding(2) var<storage, read_write> ties: Ties;
@group(0) @binding(3) var<storage, read_write> pushes: Vectors;     // see `contact`
@group(0) @binding(4) var<storage, read_write> clock: Clock;
var<immediate> surface: Surface;

// Reach of W, and how far two facets of a pair may be apart in all, in cells.
const WIDE: f32 = 0.875;
const REACH: f32 = 2.0;
// Cosines between one normal and the other reversed: full contact from the first on, none below the second.
const FACING: f32 = 0.5;
const ASKEW: f32 = 0.25;

var<workgroup> near: array<atomic<u32>, 2>;     // which groups of a tile of 64, a bit each

// Sums over the pairs of a facet.
struct Meeting {
    force: vec3f,       // [N]
    slip: vec3f,        // Σ weight · slip
    weight: f32,
    energy: f32,        // [J]
    deepest: f32,       // [m]
    coming: f32,        // fastest along the normals [m/s]
}

// What another facet does to this one.
fn pair(own: Patch, other: Patch, sum: ptr<function, Meeting>) {
    let against = -dot(own.normal, other.normal);
    let both = other.normal - own.normal;
    let n = both / max(length(both), 1e-20);
    let d = own.x - other.x;
    let depth = -dot(d, n);
    let along = d + depth * n;
    // Where faces are stretched they lie further apart, and count as at rest: their mass has not grown.
    let rest = 0.25 * surface.dx * surface.dx;
    let grown = max(1.0, max(length(own.area), length(other.area)) / rest);
    let wide = WIDE * surface.dx * sqrt(grown);
    let q = 1.0 - dot(along, along) / (wide * wide);
    let slid = own.slid - other.slid;
    let reach = max(own.reach, other.reach) + 2.0 * max(0.0, -dot(slid, n));
    let faces = max(-dot(own.area, n), 0.0) * max(dot(other.area, n), 0.0);
    if (!(q > 0.0 && depth > 0.0 && depth < reach && faces > 0.0 && against > ASKEW)) { return; }
    let facing = min(1.0, (against - ASKEW) / (FACING - ASKEW));
    let weight = facing * faces * (q * q * q * 1.27323954 / (wide * wide * grown));     // 4/π
    // Two springs in a row.
    let k = weight * (own.stiffness * other.stiffness / (own.stiffness + other.stiffness));
    let pressed = give(vec3f(depth), SOFT * surface.dx, FIRM * surface.dx).x;
    // A shock runs into both, so that each takes its part of the closing speed by the root of the other's density.
    let rate = dot(own.v - other.v, n);
    let closing = max(0.0, -rate);
    let fast = hurry(closing, own.wave + other.wave);
    let both_dense = own.dense * other.dense / (own.dense + other.dense);
    // The softer one's spring gives way most.
    let damping = (own.damping * other.stiffness + other.damping * own.stiffness) / (own.stiffness + other.stiffness);
    let taken = weight * SHOCK * (fast * both_dense) * (fast * both_dense) + k * damping * closing;
    let across = slid - dot(slid, n) * n;
    let most = min(own.friction, other.friction) * pressed;
    let kept = across * min(1.0, most / max(length(across), 1e-30));
    (*sum).force += (k * rebound(-rate, own.wave + other.wave) * pressed + taken) * n - k * kept;
    (*sum).slip += weight * kept;
    (*sum).weight += weight;
    (*sum).energy += k * (0.5 * stored(vec3f(depth), SOFT * surface.dx, FIRM * surface.dx).x + 0.25 * dot(kept, kept));
    (*sum).deepest = max((*sum).deepest, depth);
    (*sum).coming = max((*sum).coming, abs(rate));
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let dt = clock.dt;
    let groups = surface.facets / FACETS;
    if (group.x >= groups) { return; }
    let i = group.x * FACETS + lane;
    let own = load_patch(patches, i);
    let low = texel(bounds, 4u * group.x);
    let high = texel(bounds, 4u * group.x + 1u).xyz;
    let slowest = texel(bounds, 4u * group.x + 2u).xyz;
    let fastest = texel(bounds, 4u * group.x + 3u).xyz;
    let reach = REACH * surface.dx;
    var sum = Meeting(vec3f(0.0), vec3f(0.0), 0.0, 0.0, 0.0, 0.0);
    var closing = 0.0;
    for (var tile = 0u; tile < groups; tile += 64u) {
        if (lane < 2u) { atomicStore(&near[lane], 0u); }
        workgroupBarrier();
        let g = min(tile + lane, groups - 1u);
        let other = texel(bounds, 4u * g);
        let upper = texel(bounds, 4u * g + 1u).xyz;
        let slow = texel(bounds, 4u * g + 2u).xyz;
        let fast = texel(bounds, 4u * g + 3u).xyz;
        if (tile + lane < groups && bitcast<u32>(other.w) != bitcast<u32>(low.w)) {
            let apart = length(max(max(other.xyz - high, low.xyz - upper), vec3f(0.0)));
            // No two of them move faster against each other.
            let rate = length(max(fast - slowest, fastest - slow));
            // What arrives within two steps as long as this one shortens the next, so that it does not begin deep inside.
            if (apart < 2.0 * rate * dt) { closing = max(closing, rate); }
            if (apart < reach) { atomicOr(&near[lane >> 5u], 1u << (lane & 31u)); }
        }
        workgroupBarrier();
        for (var half = 0u; half < 2u; half++) {
            var left = atomicLoad(&near[half]);
            while (left != 0u) {
                let which = tile + half * 32u + firstTrailingBit(left);
                left &= left - 1u;
                let first = which * FACETS;
                // Who is not near the group looks at none of it.
                let under = texel(bounds, 4u * which).xyz - own.x;
                let over = own.x - texel(bounds, 4u * which + 1u).xyz;
                let off = max(max(under, over), vec3f(0.0));
                let count = select(0u, 32u, dot(off, off) < reach * reach);
                for (var stretch = first; stretch < first + FACETS; stretch += 32u) {
                    var hits = 0u;
                    for (var k = 0u; k < count; k++) {
                        let d = own.x - texel(patches, 6u * (stretch + k)).xyz;
                        hits |= select(0u, 1u << k, dot(d, d) < reach * reach);
                    }
                    while (hits != 0u) {
                        let j = stretch + firstTrailingBit(hits);
                        hits &= hits - 1u;
                        pair(own, load_patch(patches, j), &sum);
                    }
                }
            }
        }
        workgroupBarrier();
    }
    if ((own.tag & NO_FACET) != 0u) { return; }
    ties.d[i] = Tie(sum.slip / max(sum.weight, 1e-30), sum.energy, own.x, sum.deepest + NEAR * surface.dx);
    if (own.push != NOBODY) {
        let axis = (own.tag >> 8u) & 3u;
        let to = own.push + 1u + axis;
        let way = select(-0.25, 0.25, (own.tag & 0x400u) != 0u);
        var force = sum.force;
        if (BESIDE) { force += pushes.d[to].xyz; }
        pushes.d[to] = vec4f(force, way);
    }
    let firm = pow((sum.deepest + sum.coming * dt) / (FIRM * surface.dx), 4.0);
    // The springs' share of the fastest vibration, half of all at rest, grows by as much as the pressure steepens. That of
    // one step on, for it comes late otherwise.
    let quick = closing + 2.0 * hurry(closing, 2.0 * clock.wave_speed);
    let stiff = clock.wave_speed * sqrt(1.0 + 2.5 * firm);
    if (closing > 0.0 || firm > 0.0) { atomicMax(&clock.speed_bits, bitcast<u32>(stiff + quick)); }
}

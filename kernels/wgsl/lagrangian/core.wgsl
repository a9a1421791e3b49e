//! use lib/clock lib/touch lib/shock lib/give lib/work
// Contact of what is inside a body with the obstacles, for those that could pass into its surface: that stretches around
// them, faces turn aside or are squeezed, and at last nothing is left to push. So each point that is in an obstacle
// itself is pushed out like a face of its own size. That begins where a face would be a quarter of a cell deep. Without
// friction, which the surface has. One lane a cell; those far from all obstacles leave early.
// A cell far off: 11 loads, some 60 operations, and 6 loads and 60 operations an obstacle. One that is near some 240 loads
// besides, and with all of its points inside 240 more, 27 sums read and written and some 3000 operations.
//! texels cells: ElasticCell
//! texels nodes: ElasticNode
//! texels solids: Solid
//! texels u: vec4f
//! texels v: vec4f
//! texels colliders: Colliders
//! texels shares_was: vec4f

// As for the surface, see `contact`.
override FIRM: f32 = 0.5;
override SOFT: f32 = 0.06;

struct Vectors { d: array<vec4f> }
struct Energies { d: array<f32> }
@group(0) @binding(0) var cells: texture_1d<u32>;
@group(0) @binding(1) var nodes: texture_1d<u32>;
@group(0) @binding(2) var solids: texture_1d<u32>;
@group(0) @binding(3) var u: texture_1d<u32>;
@group(0) @binding(4) var v: texture_1d<u32>;
@group(0) @binding(5) var colliders: texture_1d<u32>;
@group(0) @binding(6) var shares_was: texture_1d<u32>;      // the same buffer, read and then written by its lane
@group(0) @binding(7) var<storage, read_write> shares: Vectors;
@group(0) @binding(8) var<storage, read_write> energies: Energies;      // of contact, a cell [J]
@group(0) @binding(9) var<storage, read_write> clock: Clock;
var<immediate> reference: Reference;

// Weight at a corner's point of the node o cells from the lowest along an axis.
fn weight_of(corner: u32, axis: u32, o: u32) -> f32 {
    return select(WEIGHT.zyx, WEIGHT, ((corner >> axis) & 1u) != 0u)[o];
}

// Square of how far the further of two neighbours is from the node in the middle.
fn spread(moved: vec3f, step: vec3f, below: u32, above: u32) -> f32 {
    let down = texel(u, below).xyz - moved - step;
    let up = texel(u, above).xyz - moved + step;
    return max(dot(down, down), dot(up, up));
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let dt = clock.dt;
    let time = clock.frame_start + clock.t;
    let waves = clock.wave_speed;
    let count = textureLoad(colliders, 0u, 0).x;
    let i = id.x;
    if (i >= reference.cells) { return; }
    let low = textureLoad(cells, 3u * i, 0);
    let high = textureLoad(cells, 3u * i + 1u, 0);
    let tail = textureLoad(cells, 3u * i + 2u, 0);
    let mask = tail.y;
    let node = high.x + 1u;     // in the middle
    let rest = texel(nodes, 4u * node).xyz;
    let moved = texel(u, node).xyz;
    // Of its neighbours along each axis the one that is furthest: points are less than half as far, however it is stretched.
    let x = spread(moved, vec3f(reference.dx, 0.0, 0.0), node - 1u, node + 1u);
    let y = spread(moved, vec3f(0.0, reference.dx, 0.0), low.w + 1u, high.y + 1u);
    let z = spread(moved, vec3f(0.0, 0.0, reference.dx), low.y + 1u, high.w + 1u);
    let wide = sqrt(max(x, max(y, z)));
    var nearest = 1e30;
    for (var k = 0u; k < count; k++) { nearest = min(nearest, gap(load_collider(k), rest + moved, time)); }
    var energy = 0.0;
    // A loop, for a software driver takes every branch.
    for (var turn = 0u; turn < select(0u, 1u, nearest < wide); turn++) {
        let solid = load_solid(solids, mask >> 16u);
        let area = 0.25 * reference.dx * reference.dx;
        let last = texel(v, node).w;
        var forces: array<vec3f, 8>;
        var deepest = 0.0;
        var closing = 0.0;
        var power = 0.0;        // force times the obstacle's velocity [W]
        for (var corner = 0u; corner < 8u; corner++) {
            if (((mask >> corner) & 1u) == 0u) { continue; }
            let quarter = select(vec3f(-0.25), vec3f(0.25), (vec3u(corner) & vec3u(1u, 2u, 4u)) != vec3u(0u));
            let x = rest + quarter * reference.dx + sum_at(cells, u, (i << 3u) | corner).v;
            var inside = 0u;
            for (var k = 0u; k < count; k++) { inside = select(inside, 1u, gap(load_collider(k), x, time) < 0.0); }
            for (var met = 0u; met < inside; met++) {
                let speed = sum_at(cells, v, (i << 3u) | corner).v;
                for (var k = 0u; k < count; k++) {
                    let c = load_collider(k);
                    let p = pose(c, time);
                    for (var side = 0u; side < sides(c); side++) {
                        let o = facing(c, p, x, time, side);
                        let depth = max(-o.gap, 0.0);
                        let approach = -dot(speed - o.v, o.n);
                        let fast = hurry(approach, solid.wave);
                        let pressed = give(vec3f(depth), SOFT * reference.dx, FIRM * reference.dx).x;
                        let spring = solid.stiffness * rebound(approach, solid.wave) * pressed;
                        let taken = SHOCK * solid.density * fast * fast + solid.stiffness * solid.damping * max(approach, 0.0);
                        let press = area * select(0.0, spring + taken, depth > 0.0);
                        forces[corner] += press * o.n;
                        power += press * dot(o.n, o.v);
                        energy += area * solid.stiffness * stored(vec3f(depth), SOFT * reference.dx, FIRM * reference.dx).x;
                        deepest = max(deepest, select(0.0, depth + abs(approach) * dt, depth > 0.0));
                        closing = max(closing, select(0.0, abs(approach) + 2.0 * fast, depth > 0.0));
                    }
                }
            }
        }
        for (var n = 0u; n < select(0u, 27u, deepest > 0.0); n++) {
            let o = vec3u(n % 3u, (n / 3u) % 3u, n / 9u);
            var sum = vec3f(0.0);
            for (var corner = 0u; corner < 8u; corner++) {
                sum += (weight_of(corner, 0u, o.x) * weight_of(corner, 1u, o.y) * weight_of(corner, 2u, o.z)) * forces[corner];
            }
            let to = n * reference.cells + tail.w;
            shares.d[to] = vec4f(texel(shares_was, to).xyz + sum, 0.0);
        }
        if (COUNTS_WORK) { count_units(0.5 * (last + dt) * power); }
        // To the 3 c²/dx² of a filled lattice and as much of its surface these springs add as much, and more where they are
        // deep; see `contact`.
        let firm = pow(deepest / (FIRM * reference.dx), 4.0);
        let stiff = sqrt(1.5 + 2.5 * firm) * solid.wave;
        if (deepest > 0.0) { atomicMax(&clock.speed_bits, bitcast<u32>(max(waves, stiff) + closing)); }
    }
    energies.d[i] = energy;
}

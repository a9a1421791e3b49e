//! use lib/sph
// Accelerations by the pressures as they are; at the end of a solve the velocities take them. One lane a particle.
//! texels points: vec4f
//! texels lists: u32
//! texels crowds: Crowd
//! texels locals: Local

// 1: the solve is over.
override LAST: bool = false;

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var points: texture_1d<u32>;
@group(0) @binding(1) var lists: texture_1d<u32>;
@group(0) @binding(2) var crowds: texture_1d<u32>;
@group(0) @binding(3) var locals: texture_1d<u32>;
@group(0) @binding(4) var<storage, read> live: Counts;
@group(0) @binding(5) var<storage, read> clock: Clock;
@group(0) @binding(6) var<storage, read_write> pushes: Vectors;    // [m/s²]
@group(0) @binding(7) var<storage, read_write> flows: Vectors;
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let stride = clock.particles;
    let dt = clock.dt;
    let placed = live.cursor;
    let inv_h = 1.0 / h_of();
    let i = id.x;
    if (i >= placed) { return; }
    let here = texel(points, i);
    let own = load_local(locals, i);
    let count = load_crowd(crowds, i).count;
    var push = vec3f(0.0);
    for (var n = 0u; n < count; n += 4u) {
        let four = listed(lists, stride, i, n);
        for (var k = 0u; k < 4u; k++) {
            let j = select(select(four.x, four.y, k == 1u), select(four.z, four.w, k == 3u), k > 1u);
            let there = texel(points, j);
            let d = here.xyz - there.xyz;
            let r = max(length(d), 1e-20);
            push += d * ((here.w + there.w) * spline_slope(r * inv_h) * inv_h / r);
        }
    }
    let a = press(own, push, here.w);
    if (LAST) {
        flows.d[i] += vec4f(dt * a, 0.0);
    } else {
        pushes.d[i] = vec4f(a, 0.0);
    }
}

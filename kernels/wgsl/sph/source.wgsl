//! use lib/sph
// What a pressure solve of DFSPH (Bender & Koschier 2015) has to undo: by how much s would be above 1 after the step
// (density), or grow in it (divergence); and the last step's pressure to start from. One lane a particle.
//! texels places: vec4f
//! texels flows: vec4f
//! texels lists: u32
//! texels crowds: Crowd
//! texels locals: Local
//! texels warm: vec4f

override DIVERGENCE: bool = false;

struct Words { d: array<u32> }
struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var places: texture_1d<u32>;
@group(0) @binding(1) var flows: texture_1d<u32>;
@group(0) @binding(2) var lists: texture_1d<u32>;
@group(0) @binding(3) var crowds: texture_1d<u32>;
@group(0) @binding(4) var locals: texture_1d<u32>;
@group(0) @binding(5) var warm: texture_1d<u32>;
@group(0) @binding(6) var<storage, read> live: Counts;
@group(0) @binding(7) var<storage, read> clock: Clock;
@group(0) @binding(8) var<storage, read_write> points: Vectors;    // x [m], P = p/s² [Pa]
@group(0) @binding(9) var<storage, read_write> wants: Words;      // bits of the excess of s
@group(0) @binding(10) var<storage, read_write> stirs: Words;      // bits of what the divergence solve found [Pa]
var<immediate> grid: Grid;

// A particle with less around it than this is spray: its divergence means nothing.
const SPRAY: f32 = 0.75;
// Share of the last step's pressure to start from. Too much pressure is no error that ends a solve, so some of it leaks.
const KEPT: f32 = 0.7;
// Most of an excess that is there already is mended in one step. To mend more, particles would have to go further than the next
// step lets them, at a speed that makes it shorter still. The size is by trial: with 0.07 and 0.1 two or three of seven plungers
// that come down to a floor stalled, with 0.03 a block of the stress suite did.
const MENDED: f32 = 0.05;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let stride = clock.particles;
    let dt = clock.dt;
    let placed = live.cursor;
    let inv_h = 1.0 / h_of();
    let i = id.x;
    if (i >= placed) { return; }
    let here = texel(places, i);
    let v = texel(flows, i).xyz;
    let own = load_local(locals, i);
    let count = load_crowd(crowds, i).count;
    var rate = dot(v, own.wall) - own.drift;
    for (var n = 0u; n < count; n += 4u) {
        let four = listed(lists, stride, i, n);
        for (var k = 0u; k < 4u; k++) {
            let j = select(select(four.x, four.y, k == 1u), select(four.z, four.w, k == 3u), k > 1u);
            let d = here.xyz - texel(places, j).xyz;
            let r = max(length(d), 1e-20);
            rate += dot(v - texel(flows, j).xyz, d) * (spline_slope(r * inv_h) * inv_h / r);
        }
    }
    let last = texel(warm, i);
    if (DIVERGENCE) {
        wants.d[i] = bitcast<u32>(select(max(dt * rate, 0.0), 0.0, own.fill < SPRAY));
        points.d[i] = vec4f(here.xyz, KEPT * last.w);
    } else {
        stirs.d[i] = bitcast<u32>(points.d[i].w);
        wants.d[i] = bitcast<u32>(min(own.fill - 1.0, MENDED) + dt * rate);
        points.d[i] = vec4f(here.xyz, KEPT * last.z);
    }
}

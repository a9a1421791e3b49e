//! use lib/sph lib/solve
// One step of a pressure solve: what the accelerations leave of the excess of s changes each pressure by a part of what
// would undo it (Jacobi); none becomes negative; then the change goes on by Nesterov's momentum, since plain Jacobi needs
// some hundred passes for ten layers of fluid. Sums up what is left. One lane a particle.
//! texels places: vec4f
//! texels pushes: vec4f
//! texels lists: u32
//! texels crowds: Crowd
//! texels locals: Local
//! texels wants: u32

struct Words { d: array<u32> }
struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var places: texture_1d<u32>;
@group(0) @binding(1) var pushes: texture_1d<u32>;
@group(0) @binding(2) var lists: texture_1d<u32>;
@group(0) @binding(3) var crowds: texture_1d<u32>;
@group(0) @binding(4) var locals: texture_1d<u32>;
@group(0) @binding(5) var wants: texture_1d<u32>;
@group(0) @binding(6) var<storage, read> live: Counts;
@group(0) @binding(7) var<storage, read> clock: Clock;
@group(0) @binding(8) var<storage, read_write> points: Vectors;
@group(0) @binding(9) var<storage, read_write> solve: Solve;
@group(0) @binding(10) var<storage, read_write> lasts: Words;      // bits of the pressures before the momentum
var<immediate> grid: Grid;

// 1: viscosity is solved for, so steps are long.
override IMPLICIT: bool = false;

// Share of a step of Jacobi's that keeps it from overshooting. With Nesterov's momentum a mode dies out only where this
// times its eigenvalue is below 4/3. In the many passes of long steps, half a step ran away where a wall holds thick
// liquid; the share below did not.
fn relaxed() -> f32 { return select(0.5, 0.4, IMPLICIT); }
// No particle counts for more than this in the mean error.
const MOST: f32 = 0.05;

var<workgroup> left: atomic<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    let stride = clock.particles;
    let dt = clock.dt;
    let placed = live.cursor;
    let turn = f32(solve.iterations);
    if (id.x < placed) { relax(id.x, stride, dt, turn); }
    workgroupBarrier();
    // Integers: the sum is the same in any order.
    if (lane == 0u) { atomicAdd(&solve.residual, (atomicLoad(&left) + 32u) >> 6u); }
}

fn relax(i: u32, stride: u32, dt: f32, turn: f32) {
    let inv_h = 1.0 / h_of();
    let x = texel(places, i).xyz;
    let a = texel(pushes, i).xyz;
    let own = load_local(locals, i);
    let count = load_crowd(crowds, i).count;
    var rate = dot(a, own.wall);
    for (var n = 0u; n < count; n += 4u) {
        let four = listed(lists, stride, i, n);
        for (var k = 0u; k < 4u; k++) {
            let j = select(select(four.x, four.y, k == 1u), select(four.z, four.w, k == 3u), k > 1u);
            let d = x - texel(places, j).xyz;
            let r = max(length(d), 1e-20);
            rate += dot(a - texel(pushes, j).xyz, d) * (spline_slope(r * inv_h) * inv_h / r);
        }
    }
    let excess = bitcast<f32>(word(wants, i)) + dt * dt * rate;
    let pressure = points.d[i].w;
    let next = max(pressure + relaxed() * excess / max(dt * dt * own.response, 1e-30), 0.0);
    let last = select(bitcast<f32>(lasts.d[i]), pressure, turn == 0.0);
    points.d[i].w = max(next + turn / (turn + 3.0) * (next - last), 0.0);
    lasts.d[i] = bitcast<u32>(next);
    atomicAdd(&left, u32(clamp(excess, 0.0, MOST) * (64.0 * RESIDUAL)));
}

//! use lib/sph lib/work
// Velocities after all forces but, in DFSPH, the pressure: pairs by the symmetric forms that keep momentum, pressure by
// F = −V² Σ (p_i/s_i² + p_j/s_j²) ∇W (Solenthaler & Pajarola 2008), viscosity along the line of centres, between bodies
// by the harmonic mean, which carries stress from one to the other (Cleary 1998). One lane a particle.
//! texels points: vec4f
//! texels flows: vec4f
//! texels lists: u32
//! texels crowds: Crowd
//! texels locals: Local

override INCOMPRESSIBLE: bool = false;
// 1: viscosity and the drag of walls are solved for afterwards.
override IMPLICIT: bool = false;

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var points: texture_1d<u32>;
@group(0) @binding(1) var flows: texture_1d<u32>;
@group(0) @binding(2) var lists: texture_1d<u32>;
@group(0) @binding(3) var crowds: texture_1d<u32>;
@group(0) @binding(4) var locals: texture_1d<u32>;
@group(0) @binding(5) var<storage, read> live: Counts;
@group(0) @binding(6) var<storage, read_write> clock: Clock;
@group(0) @binding(7) var<storage, read_write> flown: Vectors;     // as `flows`
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
    let flow = texel(flows, i);
    let own = load_local(locals, i);
    let count = select(load_crowd(crowds, i).count, 0u, IMPLICIT && INCOMPRESSIBLE);
    var push = vec3f(0.0);
    var shear = vec3f(0.0);
    for (var n = 0u; n < count; n += 4u) {
        let four = listed(lists, stride, i, n);
        for (var k = 0u; k < 4u; k++) {
            let j = select(select(four.x, four.y, k == 1u), select(four.z, four.w, k == 3u), k > 1u);
            let there = texel(points, j);
            let other = texel(flows, j);
            let d = here.xyz - there.xyz;
            let r = max(length(d), 1e-20);
            let e = d / r;
            if (!INCOMPRESSIBLE) { push += e * (spline_slope(r * inv_h) * inv_h * (here.w + there.w)); }
            if (!IMPLICIT) {
                shear -= e * (rub(r * inv_h) * between(flow.w, other.w) * dot(flow.xyz - other.xyz, e));
            }
        }
    }
    var a = own.drive + inv_h * inv_h / own.density * shear;
    if (!INCOMPRESSIBLE) { a += press(own, push, here.w); }
    var v = flow.xyz + dt * a;
    if (!IMPLICIT) {
        // Stands any step.
        let held = dt * own.drag;
        let free = v;
        v = (v + held * own.slide) / (1.0 + held);
        v -= dt / (1.0 + dt * length(own.squeeze)) * squeezed(own, v - own.slide);
        if (COUNTS_WORK && (own.tag & PINNED) == 0u) { count_work(mass_of(own) * dot(v - free, own.slide)); }
    }
    if ((own.tag & PINNED) != 0u) { v = vec3f(0.0); }
    flown.d[i] = vec4f(v, flow.w);
}

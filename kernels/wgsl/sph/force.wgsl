//! use lib/sph
// Velocities after all forces but, in DFSPH, the pressure: pairs by the symmetric forms that keep momentum, pressure by
// F = −V² Σ (p_i/s_i² + p_j/s_j²) ∇W (Solenthaler & Pajarola 2008), viscosity by Morris (1997). One lane a particle.
//! texels points: vec4f
//! texels flows: vec4f
//! texels lists: u32
//! texels crowds: Crowd
//! texels locals: Local

override INCOMPRESSIBLE: bool = false;

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var points: texture_1d<u32>;
@group(0) @binding(1) var flows: texture_1d<u32>;
@group(0) @binding(2) var lists: texture_1d<u32>;
@group(0) @binding(3) var crowds: texture_1d<u32>;
@group(0) @binding(4) var locals: texture_1d<u32>;
@group(0) @binding(5) var<storage, read> live: Counts;
@group(0) @binding(6) var<storage, read> clock: Clock;
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
    let count = load_crowd(crowds, i).count;
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
            let g = spline_slope(r * inv_h) * inv_h / r;
            if (!INCOMPRESSIBLE) { push += d * (g * (here.w + there.w)); }
            shear += (flow.xyz - other.xyz) * (g * other.w);
        }
    }
    var a = own.drive + 2.0 * flow.w / (STEEP * own.density) * shear;
    if (!INCOMPRESSIBLE) { a += press(own, push, here.w); }
    let v = flow.xyz + dt * a;
    // Stands any step.
    let held = dt * own.drag;
    flown.d[i] = vec4f((v + held * own.slide) / (1.0 + held), flow.w);
}

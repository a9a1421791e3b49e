//! use lib/sph
// Viscosity and the drag of walls that stick, as operator and as what is left of it: backward Euler's velocities v solve
// v + dt D v + dt/(ρ h²) Σ k (v_i − v_j)·e e = v* + dt D wall, k as in `sph/force` (as Weiler 2018 does with Monaghan's
// form). Divided by the density and not by a block of the matrix, conjugate gradients keep momentum and angular momentum
// however early they end. One lane a particle.
//! texels places: vec4f
//! texels motions: vec4f
//! texels lists: u32
//! texels crowds: Crowd
//! texels locals: Local
//! texels numbers: u32

// 1: what v* leaves, to begin with; else the operator, and products with what it was applied to.
override OPENS: bool = false;

struct Vectors { d: array<vec4f> }
struct Pairs { d: array<vec2f> }
@group(0) @binding(0) var places: texture_1d<u32>;
@group(0) @binding(1) var motions: texture_1d<u32>;     // v* or z [m/s], viscosity over what shears [Pa s]
@group(0) @binding(2) var lists: texture_1d<u32>;
@group(0) @binding(3) var crowds: texture_1d<u32>;
@group(0) @binding(4) var locals: texture_1d<u32>;
@group(0) @binding(5) var<storage, read> live: Counts;
@group(0) @binding(6) var<storage, read> clock: Clock;
@group(0) @binding(7) var<storage, read_write> answers: Vectors;   // z, or what it is mapped to [m/s]; the viscosity
@group(0) @binding(8) var<storage, read_write> shares: Pairs;     // of each particle by its number: ρ z·z, ρ z·Az
@group(0) @binding(9) var numbers: texture_1d<u32>;
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let stride = clock.particles;
    let dt = clock.dt;
    let placed = live.cursor;
    if (id.x >= placed) { return; }
    let share = resist(id.x, stride, dt);
    if (!OPENS) { shares.d[word(numbers, id.x)] = share; }
}

fn resist(i: u32, stride: u32, dt: f32) -> vec2f {
    let inv_h = 1.0 / h_of();
    let x = texel(places, i).xyz;
    let motion = texel(motions, i);
    let own = load_local(locals, i);
    let count = load_crowd(crowds, i).count;
    var shear = vec3f(0.0);
    for (var n = 0u; n < count; n += 4u) {
        let four = listed(lists, stride, i, n);
        for (var k = 0u; k < 4u; k++) {
            let j = select(select(four.x, four.y, k == 1u), select(four.z, four.w, k == 3u), k > 1u);
            let other = texel(motions, j);
            let d = x - texel(places, j).xyz;
            let r = max(length(d), 1e-20);
            let e = d / r;
            shear += e * (rub(r * inv_h) * between(motion.w, other.w) * dot(motion.xyz - other.xyz, e));
        }
    }
    let slowed = dt * inv_h * inv_h / own.density * shear;
    let held = dt * own.drag;
    var answer = motion.xyz + held * motion.xyz + dt * squeezed(own, motion.xyz) + slowed;
    if (OPENS) {
        let over = own.slide - motion.xyz;
        answer = held * over + dt * squeezed(own, over) - slowed;
    }
    // What is held has nothing left, and takes no part.
    if ((own.tag & PINNED) != 0u) { answer = vec3f(0.0); }
    answers.d[i] = vec4f(answer, motion.w);
    return own.density * vec2f(dot(motion.xyz, motion.xyz), dot(motion.xyz, answer));
}

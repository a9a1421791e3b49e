//! use lib/sph lib/keep lib/work
// The end of a step: friction at walls, the speed limit, new places, written both to what the next step begins with, should
// it keep its lists, and back to the particles by their numbers. One lane a particle.
//! texels points: vec4f
//! texels flows: vec4f
//! texels locals: Local
//! texels numbers: u32
//! texels stirs: u32
//! texels bodies: Body

// A body has an emitter.
override NOZZLES: bool = false;
// 1: viscosity and the drag of walls were solved for.
override IMPLICIT: bool = false;

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var points: texture_1d<u32>;
@group(0) @binding(1) var flows: texture_1d<u32>;
@group(0) @binding(2) var locals: texture_1d<u32>;
@group(0) @binding(3) var numbers: texture_1d<u32>;
@group(0) @binding(4) var stirs: texture_1d<u32>;   // bits of what the divergence solve found [Pa]
@group(0) @binding(5) var<storage, read> live: Counts;
@group(0) @binding(6) var<storage, read_write> clock: Clock;
@group(0) @binding(7) var<storage, read_write> particles: Vectors;     // six a particle
// Of a body with an emitter p.yzw is the velocity in its nozzle, λ that times the place where it ends [m²/s].
@group(0) @binding(8) var bodies: texture_1d<u32>;
// As `sph/pack` leaves them.
@group(0) @binding(9) var<storage, read_write> places: Vectors;    // x [m], density at rest [kg/m³]
@group(0) @binding(10) var<storage, read_write> moves: Vectors;    // v [m/s], tag
@group(0) @binding(11) var<storage, read_write> warm: Vectors;     // s, the pressure, and the parts to start from [Pa]
@group(0) @binding(12) var<storage, read_write> keep: Keep;
var<immediate> grid: Grid;

var<workgroup> fastest: atomic<u32>;
var<workgroup> apart: atomic<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    let dt = clock.dt;
    let sound = clock.wave_speed;
    let placed = live.cursor;
    if (id.x < placed) { step(id.x, dt); }
    workgroupBarrier();
    if (lane == 0u) {
        // What is heard at the speed of sound is carried along.
        let most = bitcast<f32>(atomicLoad(&fastest)) + sound;
        atomicMax(&clock.speed_bits, bitcast<u32>(most));
        atomicMax(&keep.apart, atomicLoad(&apart));
    }
}

fn step(i: u32, dt: f32) {
    let place = texel(points, i);
    let own = load_local(locals, i);
    var v = texel(flows, i).xyz;
    let number = word(numbers, i);
    let stir = bitcast<f32>(word(stirs, i));
    let pressure = (place.w + stir) * own.fill * own.fill;
    let mass = mass_of(own);
    var work = mass * dt * given(own, place.w + stir);
    // Of the drag that `sph/force` has not counted.
    if (IMPLICIT && (own.tag & PINNED) == 0u) {
        let over = v - own.slide;
        work -= mass * dt * dot(own.drag * over + squeezed(own, over), own.slide);
    }
    let rub = length(own.wall);
    if (own.friction > 0.0 && rub > 0.0) {
        // Coulomb: no more than its coefficient times what the wall's pressure gives along the normal, and none where it pulls.
        let n = own.wall / rub;
        let over = v - own.slide;
        let slip = over - n * dot(over, n);
        let most = dt * own.friction * max(place.w + stir, 0.0) * rub / own.density;
        let speed = length(slip);
        let lost = slip * min(1.0, most / max(speed, 1e-20));
        v -= lost;
        work -= mass * dot(lost, own.slide);
    }
    if (COUNTS_WORK) { count_work(work); }
    // Nothing may cross more than its spacing in a step.
    let limit = h_of() / dt;
    let speed = length(v);
    if (speed > limit) {
        v *= limit / speed;
        atomicAdd(&clock.clamped_velocity, 1u);
    }
    if ((own.tag & PINNED) != 0u) { v = vec3f(0.0); }
    var tag = own.tag;
    if (NOZZLES && (tag & LED) != 0u) {
        let at = 3u * (tag & BODY_MASK);
        let led = texel(bodies, at + 1u).yzw;
        if (dot(led, place.xyz) < texel(bodies, at).w) {
            if (COUNTS_WORK) { count_work(0.5 * mass * (dot(led, led) - dot(v, v))); }
            v = led;
        } else { tag &= ~LED; }
    }
    let x = place.xyz + dt * v;
    let found = vec4f(own.fill, pressure, place.w, stir);
    places.d[i] = vec4f(x, own.density);
    moves.d[i] = vec4f(v, bitcast<f32>(tag));
    warm.d[i] = found;
    let to = 6u * number;
    particles.d[to] = vec4f(x, bitcast<f32>(tag));
    particles.d[to + 1u] = vec4f(v, mass);
    particles.d[to + 5u] = found;
    if (length(v) > 0.0) { atomicMax(&fastest, bitcast<u32>(length(v))); }
    // What is not finite is taken out by the sort, before anyone meets it.
    if (!finite(x)) {
        atomicStore(&keep.spent, 1u);
        return;
    }
    atomicMax(&apart, bitcast<u32>(length(v - keep.drift)));
    // A sample that is the same whatever the order of places.
    if ((number & 63u) == 0u) {
        for (var a = 0u; a < 3u; a++) {
            atomicMin(&keep.low[a], ranked(v[a]));
            atomicMax(&keep.high[a], ranked(v[a]));
        }
    }
}

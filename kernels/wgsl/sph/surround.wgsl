//! use lib/sph lib/wall lib/force
// What a particle meets besides its neighbours: walls, gravity and fields; in WCSPH its pressure too, by Tait's
// equation of state p = ρ c²/7 (s⁷ − 1), never negative: a free surface does not pull. Where particles are shifted it may be
// negative within a liquid, and what shifts make of s is no compression. One lane a particle.
//! texels places: vec4f
//! texels moves: vec4f
//! texels crowds: Crowd
//! texels bodies: Body
//! texels forces: Forces
//! texels colliders: Colliders
//! texels warm: vec4f
//! texels numbers: u32

override INCOMPRESSIBLE: bool = false;
// 1: particles are shifted.
override SHIFTS: bool = false;

// Depth in an obstacle from which on a particle is counted as gone through its surface [h].
const SUNK: f32 = 0.5;

// What holds still has this response at least, over 1/(ρ h²); a particle within a regular filling has 0.4.
const SLUGGISH: f32 = 0.05;

struct Vectors { d: array<vec4f> }
struct Locals { d: array<Local> }
struct Debts { d: array<Debt> }
@group(0) @binding(0) var places: texture_1d<u32>;
@group(0) @binding(1) var moves: texture_1d<u32>;
@group(0) @binding(2) var crowds: texture_1d<u32>;
@group(0) @binding(3) var bodies: texture_1d<u32>;
@group(0) @binding(4) var forces: texture_1d<u32>;
@group(0) @binding(5) var colliders: texture_1d<u32>;
@group(0) @binding(6) var warm: texture_1d<u32>;
@group(0) @binding(7) var<storage, read> live: Counts;
@group(0) @binding(8) var<storage, read_write> clock: Clock;
@group(0) @binding(9) var<storage, read_write> points: Vectors;    // x [m], P = p/s² [Pa]
@group(0) @binding(10) var<storage, read_write> flows: Vectors;    // v [m/s], viscosity μ over what shears [Pa s]
@group(0) @binding(11) var<storage, read_write> locals: Locals;
@group(0) @binding(12) var numbers: texture_1d<u32>;
@group(0) @binding(13) var<storage, read_write> debts: Debts;
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let placed = live.cursor;
    let time = clock.frame_start + clock.t;
    let sound = clock.wave_speed;
    let field_count = textureLoad(forces, 0u, 0).x;
    let collider_count = textureLoad(colliders, 0u, 0).x;
    let h = h_of();
    let i = id.x;
    if (i >= placed) { return; }
    let place = texel(places, i);
    let motion = texel(moves, i);
    let crowd = load_crowd(crowds, i);
    let density = place.w;
    let tag = bitcast<u32>(motion.w);
    let body = textureLoad(bodies, 3u * (tag & BODY_MASK), 0);
    let viscosity = bitcast<f32>(body.z);
    let gravity = texel(bodies, 3u * (tag & BODY_MASK) + 2u).xyz;
    let drive = acceleration(body.y, gravity, field_count, place.xyz, motion.xyz, time);
    var near: Near;
    for (var k = 0u; k < collider_count; k++) { look(&near, load_collider(k), place.xyz, time, h); }
    // Each once a frame: in its last step, as `tick` will find it.
    let ends = clock.frame_length - (clock.t + clock.dt) <= 1e-6 * clock.frame_length;
    if (ends && near.deepest < -SUNK && (tag & (PINNED | LED)) == 0u) { atomicAdd(&clock.sunk, 1u); }
    var m = meet_all(&near, drive, h);
    var fill = crowd.fill + 1.0 - m.free;
    var inside = 0.0;
    if (SHIFTS) {
        let number = word(numbers, i);
        let debt = debts.d[number];
        // What has not been shifted yet owes nothing.
        let owed = debt.owed + select(0.0, crowd.fill - debt.noted, debt.noted > 0.0);
        debts.d[number].owed = owed;
        fill -= owed;
        inside = inside_of(h * length(crowd.slope + m.slope));
    }
    let share = 1.0 / max(m.weight, 1e-20);
    if (INCOMPRESSIBLE) {
        // What walls on both sides take from a particle by itself no motion gives back, and no solve may ask for it.
        let held = 1.0 - smoothstep(0.0, 0.3, length(m.slope) * share);
        let own = spline(0.0) - m.free;
        if (near.count > 1u && own > 0.0) {
            fill -= held * own;
            m.drift *= 1.0 - held;
        }
    }
    let around = crowd.slope;
    let response = max(max(dot(around + m.slope, around / STEEP + m.slope), 0.0) / density + crowd.coupling / STEEP,
        SLUGGISH / (density * h * h));
    let s3 = fill * fill * fill;
    let over = s3 * s3 * fill - 1.0;
    let pressure = density * sound * sound / 7.0 * max(over, inside * over) / (fill * fill);
    points.d[i] = vec4f(place.xyz, pressure);
    // At a free face or a wall that lets slip, viscosity's sums have less to go on; what both a wall that sticks and a
    // face take is taken once.
    let sheared = min(crowd.fill + 1.0 - m.loose, crowd.fill / max(m.loose, 1e-6));
    let thick = viscosity / max(1.0 - SHEARED * (1.0 - sheared), 0.5 * sheared);
    flows.d[i] = vec4f(motion.xyz, thick * density);
    // Only fluid that is pressed has a pressure that could go on in the wall.
    var pressed = pressure;
    if (INCOMPRESSIBLE) {
        let last = texel(warm, i);
        pressed = last.z + last.w;
    }
    if (SHIFTS) { debts.d[word(numbers, i)].head = pressed / density; }
    let full = clamp(pressed / max(0.25 * density * h * length(drive), 1e-20), 0.0, 1.0);
    locals.d[i] = Local(m.slope, m.drift, drive + full * m.lift, fill, m.slide * share, m.friction * share, response,
        m.drag * viscosity, density, tag, full * thick * m.squeeze, full * m.power);
}

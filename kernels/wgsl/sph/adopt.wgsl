//! use lib/sph lib/keep
// Takes over the places that shifting (`sph/spread`) found. What walls are of s changes with them; how far they are
// counts against the lists. One lane a particle.
//! texels spread: vec4f
//! texels locals: Local
//! texels moves: vec4f
//! texels numbers: u32

struct Vectors { d: array<vec4f> }
struct Debts { d: array<Debt> }
@group(0) @binding(0) var spread: texture_1d<u32>;      // x [m], density at rest [kg/m³]
@group(0) @binding(1) var locals: texture_1d<u32>;
@group(0) @binding(2) var moves: texture_1d<u32>;
@group(0) @binding(3) var numbers: texture_1d<u32>;
@group(0) @binding(4) var<storage, read> live: Counts;
@group(0) @binding(5) var<storage, read> clock: Clock;
@group(0) @binding(6) var<storage, read_write> places: Vectors;        // as `spread`, before
@group(0) @binding(7) var<storage, read_write> particles: Vectors;     // six a particle
@group(0) @binding(8) var<storage, read_write> debts: Debts;
@group(0) @binding(9) var<storage, read_write> keep: Keep;
var<immediate> grid: Grid;

var<workgroup> apart: atomic<u32>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    if (id.x < live.cursor) { adopt(id.x, clock.dt); }
    workgroupBarrier();
    if (lane == 0u) { atomicMax(&keep.apart, atomicLoad(&apart)); }
}

fn adopt(i: u32, dt: f32) {
    let place = texel(spread, i);
    // What is lost stays where it was: the sort takes it out.
    if (!finite(place.xyz)) { return; }
    let motion = texel(moves, i);
    let number = word(numbers, i);
    let way = place.xyz - places.d[i].xyz;
    places.d[i] = place;
    particles.d[6u * number] = vec4f(place.xyz, motion.w);
    debts.d[number].owed += dot(texel(locals, 5u * i).xyz, way);
    atomicMax(&apart, bitcast<u32>(length(motion.xyz - keep.drift) + length(way) / dt));
}

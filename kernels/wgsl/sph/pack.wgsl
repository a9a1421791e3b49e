//! use lib/sph lib/spot
// Copies the particles into the order of their cells, those of a cell by their numbers, so that every sum that follows
// goes the same way on every run. One lane a place.
//! texels was: Particle
//! texels order: u32
//! texels keys: u32
//! texels starts: u32
//! texels counts: u32

struct Words { d: array<u32> }
struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var was: texture_1d<u32>;
@group(0) @binding(1) var order: texture_1d<u32>;
@group(0) @binding(2) var keys: texture_1d<u32>;
@group(0) @binding(3) var starts: texture_1d<u32>;
@group(0) @binding(4) var counts: texture_1d<u32>;
@group(0) @binding(5) var<storage, read> live: Counts;
@group(0) @binding(6) var<storage, read_write> places: Vectors;    // x [m], density at rest [kg/m³]
@group(0) @binding(7) var<storage, read_write> moves: Vectors;     // v [m/s], tag
@group(0) @binding(8) var<storage, read_write> warm: Vectors;      // in z, w: pressures the last step found [Pa]
@group(0) @binding(9) var<storage, read_write> numbers: Words;
@group(0) @binding(10) var<storage, read_write> spots: Words;      // the place, rounded (lib/spot)
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let volume = h_of() * h_of() * h_of();
    if (id.x >= live.cursor) { return; }
    let p = word(order, id.x);
    let cell = word(keys, p);
    let first = word(starts, cell);
    let count = word(counts, cell);
    var place = first;
    for (var i = 0u; i < count; i++) { place += select(0u, 1u, word(order, first + i) < p); }
    let head = texel(was, 6u * p);
    let motion = texel(was, 6u * p + 1u);
    places.d[place] = vec4f(head.xyz, motion.w / volume);
    moves.d[place] = vec4f(motion.xyz, head.w);
    warm.d[place] = texel(was, 6u * p + 5u);
    numbers.d[place] = p;
    spots.d[place] = spot(grid, head.xyz);
}

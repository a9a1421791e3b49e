//! use lib/grid lib/particle lib/texel
// How far the particles of each block reach and how fast the fastest of them is: what decides which blocks may sleep. Comes
// after `cells/locate`. Every number is the largest of its kind, so the order in which lanes come does not matter.
//! texels particles: Particle
//! texels awake: u32
//! texels keys: u32
//! texels table: u32

// As whole numbers that order like the floats they stand for (see `key`); 0 where nothing was seen.
struct Extent {
    low: array<atomic<u32>, 3>,     // of -x: the largest is the least x
    speed: atomic<u32>,             // bits of the largest speed [m/s]
    high: array<atomic<u32>, 3>,    // of x
    seen: atomic<u32>,              // 1 where there is any particle
}
struct Extents { d: array<Extent> }
@group(0) @binding(0) var particles: texture_1d<u32>;
@group(0) @binding(1) var keys: texture_1d<u32>;                    // block · 64 + cell
@group(0) @binding(2) var table: texture_1d<u32>;
@group(0) @binding(3) var<storage, read_write> extents: Extents;    // of each slot
@group(0) @binding(4) var awake: texture_1d<u32>;                   // numbers of the particles that are worked on
var<immediate> grid: Grid;

fn key(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return bits ^ select(0x80000000u, 0xffffffffu, (bits >> 31u) == 1u);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    if (id.x >= grid.count) { return; }
    let p = word(awake, id.x);
    let found = word(keys, p);
    if (found == NOWHERE) { return; }
    let slot = word(table, found >> 6u) - 1u;
    if (slot >= grid.capacity) { return; }
    let x = texel(particles, 6u * p);
    for (var a = 0u; a < 3u; a++) {
        let c = select(select(x.x, x.y, a == 1u), x.z, a == 2u);
        atomicMax(&extents.d[slot].low[a], key(-c));
        atomicMax(&extents.d[slot].high[a], key(c));
    }
    atomicMax(&extents.d[slot].speed, bitcast<u32>(length(texel(particles, 6u * p + 1u).xyz)));
    atomicStore(&extents.d[slot].seen, 1u);
}

//! use lib/particle lib/texel
// How far each body reaches and how fast its fastest particle is: what decides whether it may be left out. Every number is
// the largest of its kind, so the order in which lanes come does not matter.
//! texels particles: Particle

// As whole numbers that order like the floats they stand for (see `key`); 0 where nothing was seen.
struct Extent {
    low: array<atomic<u32>, 3>,     // of -x: the largest is the least x
    speed: atomic<u32>,             // bits of the largest speed [m/s]
    high: array<atomic<u32>, 3>,    // of x
    seen: atomic<u32>,              // 1 where there is any particle
}
struct Extents { d: array<Extent> }
struct Words { d: array<u32> }
struct Asked { count: u32 }
@group(0) @binding(0) var particles: texture_1d<u32>;
@group(0) @binding(1) var<storage, read_write> extents: Extents;
@group(0) @binding(2) var<storage, read> awake: Words;      // groups of 64 particles of which any moves
var<immediate> asked: Asked;

var<workgroup> most: array<atomic<u32>, 7>;
var<workgroup> body_low: atomic<u32>;       // of 255 - body
var<workgroup> body_high: atomic<u32>;
var<workgroup> any_here: atomic<u32>;

fn key(x: f32) -> u32 {
    let bits = bitcast<u32>(x);
    return bits ^ select(0x80000000u, 0xffffffffu, (bits >> 31u) == 1u);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let p = awake.d[group.x] * 64u + lane;
    var tag = QUARANTINED;
    var x = vec3f(0.0);
    var speed = 0u;
    if (p < asked.count) {
        let head = texel(particles, 6u * p);
        tag = bitcast<u32>(head.w);
        x = head.xyz;
        speed = bitcast<u32>(length(texel(particles, 6u * p + 1u).xyz));
    }
    let here = (tag & (QUARANTINED | ASLEEP)) == 0u;
    let body = tag & BODY_MASK;
    if (here) {
        atomicMax(&body_low, 255u - body);
        atomicMax(&body_high, body);
        atomicStore(&any_here, 1u);
    }
    workgroupBarrier();
    // Nearly every group is of one body, and gives its own maxima only.
    let one = 255u - atomicLoad(&body_low) == atomicLoad(&body_high);
    if (here) {
        for (var a = 0u; a < 3u; a++) {
            let c = select(select(x.x, x.y, a == 1u), x.z, a == 2u);
            if (one) {
                atomicMax(&most[a], key(-c));
                atomicMax(&most[4u + a], key(c));
            } else {
                atomicMax(&extents.d[body].low[a], key(-c));
                atomicMax(&extents.d[body].high[a], key(c));
            }
        }
        if (one) {
            atomicMax(&most[3], speed);
        } else {
            atomicMax(&extents.d[body].speed, speed);
            atomicStore(&extents.d[body].seen, 1u);
        }
    }
    workgroupBarrier();
    if (lane == 0u && one && atomicLoad(&any_here) == 1u) {
        let its = atomicLoad(&body_high);
        for (var a = 0u; a < 3u; a++) {
            atomicMax(&extents.d[its].low[a], atomicLoad(&most[a]));
            atomicMax(&extents.d[its].high[a], atomicLoad(&most[4u + a]));
        }
        atomicMax(&extents.d[its].speed, atomicLoad(&most[3]));
        atomicStore(&extents.d[its].seen, 1u);
    }
}

//! use lib/clock lib/grid lib/texel
// Sums of each 64 particles in the order of their numbers: places follow the order in which blocks were claimed, and sums
// of floats in that order would differ from run to run. One lane a particle.
//! texels keys: u32

struct Words { d: array<u32> }
struct Pairs { d: array<vec2f> }
@group(0) @binding(0) var keys: texture_1d<u32>;
@group(0) @binding(1) var<storage, read> awake: Words;      // groups of 64 particles that are sorted
@group(0) @binding(2) var<storage, read> clock: Clock;
@group(0) @binding(3) var<storage, read> shares: Pairs;     // of each particle, by its number
@group(0) @binding(4) var<storage, read_write> partials: Pairs;

var<workgroup> parts: array<vec2f, 64>;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let p = awake.d[group.x] * 64u + lane;
    parts[lane] = vec2f(0.0);
    // What has no place has nothing new.
    if (p < clock.particles && word(keys, p) != NOWHERE) { parts[lane] = shares.d[p]; }
    workgroupBarrier();
    if (lane < 8u) { for (var k = 1u; k < 8u; k++) { parts[lane] += parts[lane + 8u * k]; } }
    workgroupBarrier();
    if (lane == 0u) {
        var sum = parts[0];
        for (var k = 1u; k < 8u; k++) { sum += parts[k]; }
        partials.d[group.x] = sum;
    }
}

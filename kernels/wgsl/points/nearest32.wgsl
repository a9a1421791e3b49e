//! use lib/splat lib/texel
// The nearest point of every pixel without 64-bit atomics, in two passes over projected points: least depth, then
// least number among those of that depth. Writes the words of `points/nearest64`: number, then depth bits.
//! texels splats: vec4f

struct Words { d: array<atomic<u32>> }
@group(0) @binding(0) var splats: texture_1d<u32>;
@group(0) @binding(1) var<storage, read_write> keys: Words;
var<immediate> screen: Screen;

// False in the first pass, true in the second.
override NUMBERS: bool = false;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= screen.points) { return; }
    let s = texel(splats, i);
    let to = reach(s, screen);
    let depth = bitcast<u32>(s.z);
    for (var y = to.y; y <= to.w; y++) {
        for (var x = to.x; x <= to.z; x++) {
            let d = distances(s, vec2u(vec2i(x, y)));
            if (d.x >= d.y) { continue; }
            let at = (u32(y) * screen.width + u32(x)) * 2u;
            if (!NUMBERS) {
                atomicMin(&keys.d[at + 1u], depth);
            } else if (atomicLoad(&keys.d[at + 1u]) == depth) {
                atomicMin(&keys.d[at], i);
            }
        }
    }
}

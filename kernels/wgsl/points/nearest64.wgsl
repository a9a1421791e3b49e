//! use lib/splat lib/texel
// The nearest point of every pixel in one pass: the least of depth bits and point number in one 64-bit word, so that
// equal depths go to the lower number. Positive floats order like their bits.
//! texels points: vec4f

struct Keys { d: array<atomic<u64>> }
@group(0) @binding(0) var points: texture_1d<u32>;
@group(0) @binding(1) var<storage, read> camera: Camera;
@group(0) @binding(2) var<storage, read_write> keys: Keys;
var<immediate> screen: Screen;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Loaded here, where every lane runs, the camera is loaded once for all of them; software devices know no better.
    let view = camera;
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= screen.points) { return; }
    let s = splat(view, texel(points, i));
    let to = reach(s, screen);
    let key = (u64(bitcast<u32>(s.z)) << 32u) | u64(i);
    for (var y = to.y; y <= to.w; y++) {
        for (var x = to.x; x <= to.z; x++) {
            let d = distances(s, vec2u(vec2i(x, y)));
            if (d.x < d.y) { atomicMin(&keys.d[u32(y) * screen.width + u32(x)], key); }
        }
    }
}

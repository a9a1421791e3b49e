//! use lib/tile lib/texel
// Writes each point's number into the lists of the tiles it may reach. `starts` become ends. What does not fit is
// not written: `bins.total` tells the host, which makes room and draws again.
//! texels splats: vec4f

struct Starts { d: array<atomic<u32>> }
struct Words { d: array<u32> }
@group(0) @binding(0) var splats: texture_1d<u32>;
@group(0) @binding(1) var<storage, read_write> starts: Starts;
@group(0) @binding(2) var<storage, read_write> list: Words;
var<immediate> call: Room;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= call.points) { return; }
    let screen = Screen(call.width, call.height, call.points);
    let to = tile_reach(texel(splats, i), screen);
    let across = tiles_across(screen);
    for (var y = to.y; y <= to.w; y++) {
        for (var x = to.x; x <= to.z; x++) {
            let at = atomicAdd(&starts.d[u32(y) * across + u32(x)], 1u);
            if (at < call.room) { list.d[at] = i; }
        }
    }
}

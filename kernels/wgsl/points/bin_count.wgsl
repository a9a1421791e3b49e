//! use lib/tile lib/texel
// Counts how many points may reach each tile.
//! texels splats: vec4f

struct Counts { d: array<atomic<u32>> }
@group(0) @binding(0) var splats: texture_1d<u32>;
@group(0) @binding(1) var<storage, read_write> counts: Counts;
var<immediate> screen: Screen;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= screen.points) { return; }
    let to = tile_reach(texel(splats, i), screen);
    let across = tiles_across(screen);
    for (var y = to.y; y <= to.w; y++) {
        for (var x = to.x; x <= to.z; x++) {
            atomicAdd(&counts.d[u32(y) * across + u32(x)], 1u);
        }
    }
}

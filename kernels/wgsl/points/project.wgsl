//! use lib/splat lib/texel
// World points to discs in the image: centre [px], depth [m], radius [px].
//! texels points: vec4f

struct Splats { d: array<vec4f> }
@group(0) @binding(0) var points: texture_1d<u32>;
@group(0) @binding(1) var<storage, read> camera: Camera;
@group(0) @binding(2) var<storage, read_write> splats: Splats;
var<immediate> screen: Screen;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Loaded here, where every lane runs, the camera is loaded once for all of them; software devices know no better.
    let view = camera;
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= screen.points) { return; }
    splats.d[i] = splat(view, texel(points, i));
}

//! use lib/camera
// A depth map to world points, one a pixel; their radius is `spacing` times the distance between neighbouring pixels
// at their depth. Unknown depth (zero, negative or not finite) gives a point of radius 0, which nothing draws.

struct Depths { d: array<f32> }
struct Points { d: array<vec4f> }
struct DepthMap {
    width: u32,         // [px]
    height: u32,        // [px]
    spacing: f32,       // radius of a point in pixel distances
}
@group(0) @binding(0) var<storage, read> depths: Depths;     // along the view axis [m]
@group(0) @binding(1) var<storage, read> camera: Camera;
@group(0) @binding(2) var<storage, read_write> points: Points;
var<immediate> map: DepthMap;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Loaded here, where every lane runs, the camera is loaded once for all of them; software devices know no better.
    let view = camera;
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= map.width * map.height) { return; }
    let z = depths.d[i];
    let pixel = vec2f(f32(i % map.width), f32(i / map.width)) + vec2f(0.5);
    let q = vec3f((pixel - view.center) / view.focal * z, z);
    let p = vec4f(in_world(view, q), map.spacing * z / view.focal.x);
    // The test is on bits: compilers may assume there is no NaN.
    let known = (bitcast<u32>(z) & 0x7f800000u) != 0x7f800000u && z > 0.0;
    points.d[i] = select(vec4f(0.0), p, known);
}

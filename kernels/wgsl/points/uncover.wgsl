//! use lib/camera lib/texel
// The background around a moving object: pixels at its edge hold some of the object's colour, so they show the
// photograph while the object stands where it was photographed, and the filled background once it has moved away.
//! texels rest: vec4f
//! texels points: vec4f
//! texels edge: EdgePixel

struct Words { d: array<u32> }
// A pixel of the edge: its index, its nearest display point, and both pictures' colours there (RGBA8).
struct EdgePixel {
    pixel: u32,
    point: u32,
    photo: u32,
    filled: u32,
}
struct Uncovered {
    count: u32,
    full: f32,          // displacement at which the photograph is gone [px]
}
@group(0) @binding(0) var edge: texture_1d<u32>;
@group(0) @binding(1) var rest: texture_1d<u32>;
@group(0) @binding(2) var points: texture_1d<u32>;
@group(0) @binding(3) var<storage, read> camera: Camera;
@group(0) @binding(4) var<storage, read_write> background: Words;
var<immediate> call: Uncovered;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= call.count) { return; }
    let words = textureLoad(edge, i, 0);
    let e = EdgePixel(words.x, words.y, words.z, words.w);
    let a = in_camera(camera, texel(rest, e.point).xyz);
    let b = in_camera(camera, texel(points, e.point).xyz);
    let moved = length(camera.focal * (b.xy / max(b.z, 1e-6) - a.xy / max(a.z, 1e-6)));
    let share = smoothstep(0.0, call.full, moved);
    let shifts = vec3u(0u, 8u, 16u);
    let photo = vec3f((vec3u(e.photo) >> shifts) & vec3u(0xffu));
    let filled = vec3f((vec3u(e.filled) >> shifts) & vec3u(0xffu));
    let mixed = vec3u(round(mix(photo, filled, share)));
    background.d[e.pixel] = mixed.x | (mixed.y << 8u) | (mixed.z << 16u) | 0xff000000u;
}

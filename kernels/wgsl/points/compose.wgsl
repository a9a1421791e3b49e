// Draws a layer over a background, both RGBA, 8 bits each: straight alpha in integers, so that an opaque pixel of the
// layer and a background behind nothing come out bit for bit.

struct Words { d: array<u32> }
struct Background {
    pixels: u32,
    color: u32,         // background where there is no picture
}
@group(0) @binding(0) var<storage, read> layer: Words;
@group(0) @binding(1) var<storage, read> background: Words;
@group(0) @binding(2) var<storage, read_write> image: Words;
var<immediate> call: Background;

// The background is a picture of the frame's size, else one colour.
override PICTURE: bool = true;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    if (i >= call.pixels) { return; }
    let over = layer.d[i];
    var under = call.color;
    if (PICTURE) { under = background.d[i]; }
    let alpha = over >> 24u;
    let shifts = vec3u(0u, 8u, 16u);
    let a = (vec3u(over) >> shifts) & vec3u(0xffu);
    let b = (vec3u(under) >> shifts) & vec3u(0xffu);
    let mixed = (a * alpha + b * (255u - alpha) + vec3u(127u)) / 255u;
    image.d[i] = mixed.x | (mixed.y << 8u) | (mixed.z << 16u) | 0xff000000u;
}

//! use lib/splat lib/pixel lib/texel
// From the nearest point of every pixel to its colour, depth and object.
//! texels keys: vec2u
//! texels points: vec4f
//! texels colors: u32
//! texels objects: u32

struct Words { d: array<u32> }
struct Floats { d: array<f32> }
@group(0) @binding(0) var keys: texture_1d<u32>;        // point number, depth bits
@group(0) @binding(1) var points: texture_1d<u32>;
@group(0) @binding(2) var<storage, read> camera: Camera;
@group(0) @binding(3) var colors: texture_1d<u32>;      // RGBA8 of each point
@group(0) @binding(4) var objects: texture_1d<u32>;     // object of each point
@group(0) @binding(5) var<storage, read_write> image: Words;     // RGBA8, 0 where nothing is
@group(0) @binding(6) var<storage, read_write> depths: Floats;   // [m], 0 where nothing is
@group(0) @binding(7) var<storage, read_write> ids: Words;       // object, 0 where nothing is
var<immediate> screen: Screen;

override WANT_DEPTH: bool = false;
override WANT_IDS: bool = false;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Loaded here, where every lane runs, the camera is loaded once for all of them; software devices know no better.
    let view = camera;
    let at = (group.y * groups.x + group.x) * 64u + lane;
    if (at >= screen.width * screen.height) { return; }
    let pair = textureLoad(keys, at >> 1u, 0);
    let key = select(pair.xy, pair.zw, (at & 1u) != 0u);
    var pixel = 0u;
    var depth = 0.0;
    var object = 0u;
    if (key.x != NOTHING) {
        var w = 1.0;
        if (ALPHA || LEAST_WEIGHT > 1e-8) {
            // Else the weight of a single point cancels: no weight is below 6e-8.
            let s = splat(view, texel(points, key.x));
            w = weight(distances(s, vec2u(at % screen.width, at / screen.width)));
        }
        var b = Blend(vec3f(0.0), 0.0, 1.0);
        blend_in(&b, word(colors, key.x), w);
        pixel = packed(b);
        depth = bitcast<f32>(key.y);
        if (WANT_IDS) { object = word(objects, key.x); }
    }
    image.d[at] = pixel;
    if (WANT_DEPTH) { depths.d[at] = depth; }
    if (WANT_IDS) { ids.d[at] = object; }
}

//! use lib/texel
// From masks of pixels to a weight for each cell of a latent. Latent 0 is frame 0; latent k covers frames
// temporal (k - 1) + 1 to temporal k, as far as there are so many. A cell covers spatial x spatial pixels, and
// `reach` cells on every side of it, as far as the picture goes.
//! texels layers: u32

struct Weights { d: array<f32> }
struct MaskPool {
    frames: u32,
    width: u32,             // [px]
    height: u32,            // [px]
    spatial: u32,           // pixels along a cell
    temporal: u32,          // frames of a latent
    reach: u32,             // cells by which the mask grows (1 wins) or shrinks (0 wins)
    first: u32,             // 1: the weights begin at latent 0; 0: at latent 1
}
@group(0) @binding(0) var layers: texture_1d<u32>;                  // RGBA8, frame by frame; covered where alpha is not 0
@group(0) @binding(1) var<storage, read_write> weights: Weights;    // [latent, row, column]
var<immediate> call: MaskPool;

// 0: 1 where all is covered; 1: 1 where anything is; 2: the share that is.
override MODE: u32 = 0u;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = (group.y * groups.x + group.x) * 64u + lane;
    let across = (call.width + call.spatial - 1u) / call.spatial;
    let plane = across * ((call.height + call.spatial - 1u) / call.spatial);
    // Frames behind frame 0 decide how many latents follow latent 0.
    let later = (max(call.frames, 1u) - 1u + call.temporal - 1u) / call.temporal;
    if (i >= (later + call.first) * plane || call.frames == 0u) { return; }
    let latent = i / plane + 1u - call.first;
    let x = i % across;
    let y = (i % plane) / across;
    var begin = 0u;
    var end = 1u;
    if (latent > 0u) {
        begin = call.temporal * (latent - 1u) + 1u;
        end = min(call.temporal * latent + 1u, call.frames);
    }
    let left = (x - min(x, call.reach)) * call.spatial;
    let right = min((x + 1u + call.reach) * call.spatial, call.width);
    let top = (y - min(y, call.reach)) * call.spatial;
    let bottom = min((y + 1u + call.reach) * call.spatial, call.height);
    var covered = 0u;
    var seen = 0u;
    for (var frame = begin; frame < end; frame++) {
        for (var row = top; row < bottom; row++) {
            let line = (frame * call.height + row) * call.width;
            for (var column = left; column < right; column++) {
                covered += u32((word(layers, line + column) >> 24u) != 0u);
            }
            seen += right - left;
            // Nothing can change any more.
            if (MODE == 0u && covered < seen) { break; }
            if (MODE == 1u && covered > 0u) { break; }
        }
        if (MODE == 0u && covered < seen) { break; }
        if (MODE == 1u && covered > 0u) { break; }
    }
    if (MODE == 0u) {
        weights.d[i] = f32(covered == seen);
    } else if (MODE == 1u) {
        weights.d[i] = f32(covered > 0u);
    } else {
        weights.d[i] = f32(covered) / f32(seen);
    }
}

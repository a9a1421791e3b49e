//! use lib/latent lib/gaussian
// Latents where they are known, the base brought to noise level sigma elsewhere:
// z = M z + (1 - M) ((1 - sigma) base + sigma e).
//! texels base: vec4f
//! texels mask: f32

struct Latents { d: array<vec4f> }
struct Mix {
    seed: vec2u,
    count: u32,             // elements, a multiple of 4
    cells: u32,
    iteration: u32,
    stream: u32,
    sigma: f32,
}
@group(0) @binding(0) var<storage, read_write> z: Latents;
@group(0) @binding(1) var base: texture_1d<u32>;
@group(0) @binding(2) var mask: texture_1d<u32>;    // M of each cell; 1 stays as it is, bit for bit, 0 forgets z
var<immediate> call: Mix;

override MASKED: bool = false;      // mask is read, else it is 0

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let given = call;
    let turn = turn_of((group.y * groups.x + group.x) * 64u + lane, given.count);
    let i = turn.i;
    let e = normals(given.seed, given.stream, given.iteration, i);
    var next = (1.0 - given.sigma) * texel(base, i) + given.sigma * e;
    if (MASKED) {
        let m = weights(mask, i, given.cells);
        var old = vec4f(0.0);
        if (turn.live) { old = z.d[i]; }
        // At both ends a choice, so that no NaN comes over from the other side.
        let between = m * old + (1.0 - m) * next;
        next = select(select(between, next, m == vec4f(0.0)), old, m == vec4f(1.0));
    }
    if (turn.live) { z.d[i] = next; }
}

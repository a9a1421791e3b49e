//! use lib/latent lib/gaussian
// A step of the flow SDE: z += d (a z + b v + m mu) + sqrt(d) (s0 e_n + s1 e_(n+1)), with d the weight of the cell.
// Every integrator is a choice of these numbers; the noise of a step is made anew where the next needs it, so none
// keeps a state.
//! texels v: vec4f
//! texels mu: vec4f
//! texels update: f32

struct Latents { d: array<vec4f> }
struct SdeStep {
    seed: vec2u,
    count: u32,             // elements, a multiple of 4
    cells: u32,
    iteration: u32,         // n
    stream: u32,
    a: f32,
    b: f32,
    m: f32,
    s0: f32,
    s1: f32,
}
@group(0) @binding(0) var<storage, read_write> z: Latents;
@group(0) @binding(1) var v: texture_1d<u32>;
@group(0) @binding(2) var mu: texture_1d<u32>;
@group(0) @binding(3) var update: texture_1d<u32>;  // weight of each cell; 0 stays as it is, bit for bit
var<immediate> call: SdeStep;

override MASKED: bool = false;      // update is read, else it is 1
override ANCHORED: bool = false;    // mu is read
override NOISE: bool = true;        // e_n is made
override TWO: bool = false;         // e_(n+1) is made

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let given = call;
    let turn = turn_of((group.y * groups.x + group.x) * 64u + lane, given.count);
    let i = turn.i;
    var old = vec4f(0.0);
    if (turn.live) { old = z.d[i]; }
    var drift = given.a * old + given.b * texel(v, i);
    if (ANCHORED) { drift += given.m * texel(mu, i); }
    var noise = vec4f(0.0);
    if (NOISE) { noise = given.s0 * normals(given.seed, given.stream, given.iteration, i); }
    if (TWO) { noise += given.s1 * normals(given.seed, given.stream, given.iteration + 1u, i); }
    var next = old + (drift + noise);
    if (MASKED) {
        let d = weights(update, i, given.cells);
        next = select(old + (d * drift + sqrt(d) * noise), old, d == vec4f(0.0));
    }
    if (turn.live) { z.d[i] = next; }
}

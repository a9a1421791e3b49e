//! use lib/latent
// A step of the probability flow: z += a v + b w. Euler's has b = 0, Adams-Bashforth's has the velocity of the step
// before in w, the corrector of Heun's has both ends of the step.
//! texels v: vec4f
//! texels w: vec4f
//! texels free: f32

struct Latents { d: array<vec4f> }
struct FlowStep {
    count: u32,             // elements, a multiple of 4
    cells: u32,
    a: f32,
    b: f32,
}
@group(0) @binding(0) var<storage, read_write> z: Latents;
@group(0) @binding(1) var v: texture_1d<u32>;
@group(0) @binding(2) var w: texture_1d<u32>;
@group(0) @binding(3) var free: texture_1d<u32>;    // weight of each cell; 0 stays as it is, bit for bit
var<immediate> call: FlowStep;

override TWO: bool = false;     // w is read
override HELD: bool = false;    // free is read

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let given = call;
    let turn = turn_of((group.y * groups.x + group.x) * 64u + lane, given.count);
    let i = turn.i;
    var old = vec4f(0.0);
    if (turn.live) { old = z.d[i]; }
    var step = given.a * texel(v, i);
    if (TWO) { step += given.b * texel(w, i); }
    var next = old + step;
    if (HELD) { next = select(next, old, weights(free, i, given.cells) == vec4f(0.0)); }
    if (turn.live) { z.d[i] = next; }
}

//! use lib/latent
// What a network predicted, guided, as the velocity towards the data: v = kp p + kz z. The host chooses kp and kz by
// the network's convention.
//! texels z: vec4f
//! texels conditional: vec4f
//! texels unconditional: vec4f

struct Latents { d: array<vec4f> }
struct Adapt {
    count: u32,             // elements, a multiple of 4
    kp: f32,
    kz: f32,
    guidance: f32,
}
@group(0) @binding(0) var z: texture_1d<u32>;
@group(0) @binding(1) var conditional: texture_1d<u32>;
@group(0) @binding(2) var unconditional: texture_1d<u32>;
@group(0) @binding(3) var<storage, read_write> velocity: Latents;
var<immediate> call: Adapt;

// Classifier-free guidance (Ho and Salimans 2022); without it `unconditional` is not read.
override GUIDED: bool = false;

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let given = call;
    let turn = turn_of((group.y * groups.x + group.x) * 64u + lane, given.count);
    let i = turn.i;
    var p = texel(conditional, i);
    if (GUIDED) {
        let u = texel(unconditional, i);
        p = u + given.guidance * (p - u);
    }
    let v = given.kp * p + given.kz * texel(z, i);
    if (turn.live) { velocity.d[i] = v; }
}

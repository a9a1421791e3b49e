//! use lib/descent lib/grid
// One update of conjugate gradients: the direction and what it is mapped to turn, velocities go along, less is left.
// One lane a particle.

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var<storage, read> descent: Descent;
@group(0) @binding(1) var<storage, read> live: Counts;
@group(0) @binding(2) var<storage, read> pulls: Vectors;           // A z [m/s]
@group(0) @binding(3) var<storage, read_write> lefts: Vectors;     // z, what is left [m/s]
@group(0) @binding(4) var<storage, read_write> aims: Vectors;      // p, the direction
@group(0) @binding(5) var<storage, read_write> draws: Vectors;     // A p
@group(0) @binding(6) var<storage, read_write> flown: Vectors;     // v [m/s]; the fourth stays

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let along = descent.along;
    let turn = descent.turn;
    let i = id.x;
    if (i >= live.cursor) { return; }
    let left = lefts.d[i];
    var aim = left.xyz;
    var draw = pulls.d[i].xyz;
    // At the start there is no direction yet.
    if (turn != 0.0) {
        aim += turn * aims.d[i].xyz;
        draw += turn * draws.d[i].xyz;
    }
    aims.d[i] = vec4f(aim, 0.0);
    draws.d[i] = vec4f(draw, 0.0);
    flown.d[i] += vec4f(along * aim, 0.0);
    lefts.d[i] = vec4f(left.xyz - along * draw, left.w);
}

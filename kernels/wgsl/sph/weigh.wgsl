//! use lib/descent lib/clock
// Opens a solve by conjugate gradients; adds up the sums of a pass, chooses how far to go and by how much the direction
// turns; and ends the solve once little enough is left. One workgroup.

struct Scale {
    opens: u32,         // 1: a solve begins
    last: u32,          // 1: there are no more passes
    tolerance: f32,     // what may be left, over what there was
}
struct Pairs { d: array<vec2f> }
@group(0) @binding(0) var<storage, read_write> descent: Descent;
@group(0) @binding(1) var<storage, read> clock: Clock;
@group(0) @binding(2) var<storage, read> partials: Pairs;
var<immediate> scale: Scale;

var<workgroup> parts: array<vec2f, 64>;

@compute @workgroup_size(64)
fn main(@builtin(local_invocation_index) lane: u32) {
    let count = select(clock.particle_groups.x, 0u, scale.opens != 0u);
    var sum = vec2f(0.0);
    for (var i = lane; i < count; i += 64u) { sum += partials.d[i]; }
    parts[lane] = sum;
    workgroupBarrier();
    if (lane < 8u) { for (var k = 1u; k < 8u; k++) { parts[lane] += parts[lane + 8u * k]; } }
    workgroupBarrier();
    if (lane != 0u) { return; }
    if (scale.opens != 0u) {
        descent.groups = clock.particle_groups;
        descent.iterations = 0u;
        return;
    }
    if (descent.groups.x == 0u) { return; }
    var all = parts[0];
    for (var k = 1u; k < 8u; k++) { all += parts[k]; }
    let begins = descent.iterations == 0u;
    let turn = select(all.x / descent.size, 0.0, begins);
    let under = all.y - select(turn * all.x / descent.along, 0.0, begins);
    if (begins) { descent.first = all.x; }
    let ends = all.x <= scale.tolerance * scale.tolerance * descent.first;
    // Where rounding leaves no way down there is none to go.
    if (ends || !(under > 0.0) || scale.last != 0u) {
        descent.groups.x = 0u;
        descent.unsolved += select(1u, 0u, ends);
        return;
    }
    descent.size = all.x;
    descent.turn = turn;
    descent.along = all.x / under;
    descent.iterations += 1u;
    descent.all += 1u;
    descent.worst = max(descent.worst, descent.iterations);
}

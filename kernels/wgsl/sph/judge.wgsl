//! use lib/solve
// Opens a solve, and ends it once the mean of what is left of the error is small enough.

struct Rule {
    opens: u32,         // 1: a solve begins
    least: u32,         // iterations
    last: u32,          // 1: there are no more
    tolerance: f32,     // of the mean excess of s
}
@group(0) @binding(0) var<storage, read_write> solve: Solve;
@group(0) @binding(1) var<storage, read> live: Counts;
@group(0) @binding(2) var<storage, read> clock: Clock;
var<immediate> rule: Rule;

@compute @workgroup_size(1)
fn main() {
    if (rule.opens != 0u) {
        solve.groups = clock.particle_groups;
        solve.iterations = 0u;
        atomicStore(&solve.residual, 0u);
        return;
    }
    if (solve.groups.x == 0u) { return; }
    let mean = f32(atomicExchange(&solve.residual, 0u)) / (RESIDUAL * max(f32(live.cursor), 1.0));
    solve.iterations += 1u;
    solve.all += 1u;
    solve.worst = max(solve.worst, solve.iterations);
    if (solve.iterations >= rule.least && mean <= rule.tolerance) {
        solve.groups.x = 0u;
    } else if (rule.last != 0u) {
        solve.unsolved += 1u;
    }
}

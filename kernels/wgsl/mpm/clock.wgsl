//! use lib/clock lib/grid lib/tick lib/open
// Opens an empty list of active blocks, and chooses the next substep, for solvers whose sort does not (`cells/range`).

@group(0) @binding(0) var<storage, read_write> clock: Clock;
@group(0) @binding(1) var<storage, read_write> live: Live;

@compute @workgroup_size(1)
fn main() {
    open_list();
    tick();
}

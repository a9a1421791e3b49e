//! use lib/clock lib/grid lib/tick
// Opens an empty list of active blocks, and chooses the next substep, for solvers whose sort does not (`cells/range`).

@group(0) @binding(0) var<storage, read_write> clock: Clock;
@group(0) @binding(1) var<storage, read_write> live: Live;

@compute @workgroup_size(1)
fn main() {
    atomicStore(&live.blocks, 0u);
    atomicStore(&live.nodes, 0u);
    atomicStore(&live.cursor, 0u);
    atomicStore(&live.rows, 0u);
    atomicStore(&live.row_groups, 0u);
    atomicStore(&live.upper, 0u);
    live.row_groups_y = 1u;
    live.row_groups_z = 1u;
    live.blocks_y = 1u;
    live.blocks_z = 1u;
    live.nodes_y = 1u;
    live.nodes_z = 1u;
    tick();
}

// Begins with no active block: `live` is that of the kernel, of which one invocation comes here.
fn open_list() {
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
}

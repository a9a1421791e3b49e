// Makes room for the sort of the next substep; `table` and `live` are those of the kernel. What follows finds its
// neighbours by links, and how many particles there are in `live.placed`.

fn forget(slot: u32, block: u32) {
    table.d[block] = EMPTY;
    if (slot != 0u) { return; }
    live.placed = live.cursor;
    live.cursor = 0u;
    live.blocks = 0u;
    live.nodes = 0u;
    live.rows = 0u;
    live.row_groups = 0u;
    live.upper = 0u;
}

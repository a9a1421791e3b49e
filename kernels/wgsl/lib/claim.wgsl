// Finds cells and claims their blocks; `table`, `claimed` (the same table, read), `list`, `live` and `grid` are those of
// the kernel. Slots are claimed in any order; nothing that follows depends on that order.

// Block · 64 + cell of a particle at x that moves at v; NOWHERE where it is not finite or outside the grid.
fn cell_key(x: vec3f, v: vec3f) -> u32 {
    let base = base_node(grid, x);
    if (!finite(x) || !finite(v) || !inside(grid, base)) { return NOWHERE; }
    let node = vec3u(base);
    let cell = node & vec3u(3u);
    return (block_index(grid, node >> vec3u(2u)) << 6u) | (cell.z << 4u) | (cell.y << 2u) | cell.x;
}

// Makes a block active. Most are claimed already, and a plain look is cheaper than an atomic one.
fn claim(block: u32) {
    if (word(claimed, block) != EMPTY) { return; }
    let won = atomicCompareExchangeWeak(&table.d[block], EMPTY, NOWHERE);
    if (!won.exchanged) { return; }
    let slot = atomicAdd(&live.blocks, 1u);
    if (slot < grid.capacity) {
        list.d[slot] = block;
        atomicStore(&table.d[block], slot + 1u);
    }
}

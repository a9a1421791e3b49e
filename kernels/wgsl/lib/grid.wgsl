// The background grid: nodes at origin + index · dx, in blocks of 4³, of which only those touched exist.

const EMPTY: u32 = 0u;          // table entry of a block that is not active; else slot + 1
const TILE: u32 = 216u;         // 6³ nodes reached by the particles of one block
const NOWHERE: u32 = 0xffffffffu;

// Every kernel gets it as an immediate: constants of a call cost nothing to read.
struct Grid {
    origin: vec3f,      // [m]
    dx: f32,            // [m]
    blocks: vec3u,      // size in blocks
    capacity: u32,      // slots there is room for
    rows: u32,          // occupied rows there is room for
    run: u32,           // of a call for a stretch of the particles: which (`Clock.runs`)
    count: u32,         // of a call for listed particles between frames: how many
}

// Counters that are at the same time the sizes of indirect dispatches.
struct Live {
    blocks: atomic<u32>,    // slots 0..blocks hold particles
    blocks_y: u32,
    blocks_z: u32,
    cursor: atomic<u32>,    // next free place in the particle order
    nodes: atomic<u32>,     // slots 0..nodes hold nodes: the blocks and their upper neighbours
    nodes_y: u32,
    nodes_z: u32,
    overflow: atomic<u32>,  // slots that did not fit
    row_groups: atomic<u32>,    // workgroups of ROW_LANES over the occupied rows
    row_groups_y: u32,
    row_groups_z: u32,
    rows: atomic<u32>,      // occupied rows
    crowded: atomic<u32>,   // occupied rows that did not fit
    placed: u32,            // particles in the order, once the grid has what they give
    upper: atomic<u32>,     // neighbours claimed for their nodes alone
}

// The same where nobody else changes them.
struct Counts {
    blocks: u32,
    blocks_y: u32,
    blocks_z: u32,
    cursor: u32,
    nodes: u32,
    nodes_y: u32,
    nodes_z: u32,
    overflow: u32,
    row_groups: u32,
    row_groups_y: u32,
    row_groups_z: u32,
    rows: u32,
    crowded: u32,
    placed: u32,
    upper: u32,
}

// Four cells along x that hold particles: slot · 16 + place in the block, their stretch of the particle order, block.
struct Row {
    id: u32,
    first: u32,
    count: u32,
    block: u32,
}

// Vectors that a row gives to the 6 × 3 × 3 nodes it reaches: x slowest, then z, then y.
const ROW_SHARES: u32 = 54u;

fn block_index(g: Grid, b: vec3u) -> u32 {
    return (b.z * g.blocks.y + b.y) * g.blocks.x + b.x;
}

fn block_coord(g: Grid, i: u32) -> vec3u {
    return vec3u(i % g.blocks.x, (i / g.blocks.x) % g.blocks.y, i / (g.blocks.x * g.blocks.y));
}

// First of the three nodes per axis that a quadratic B-spline at x reaches, and x relative to it in cells.
fn base_node(g: Grid, x: vec3f) -> vec3f {
    return floor((x - g.origin) / g.dx - vec3f(0.5));
}

// Every node a particle there would reach lies inside the grid.
fn inside(g: Grid, base: vec3f) -> bool {
    let last = vec3f(g.blocks * 4u) - vec3f(3.0);
    return all(base >= vec3f(0.0)) && all(base <= last);
}

// Rows of a workgroup: few, so that a small body's rows still keep every core busy.
const ROW_LANES: u32 = 8u;

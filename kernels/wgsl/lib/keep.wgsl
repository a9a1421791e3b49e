// Neighbour lists that are kept over several steps (Verlet 1967): they reach a skin further than needed, and hold until
// two particles can have come nearer to each other by that.
struct Keep {
    groups: vec3u,      // workgroups of 64 particles of a step that searches; x = 0 in one that keeps its lists
    spent: atomic<u32>, // 1: the next step searches, whatever has moved
    clear: vec3u,       // workgroups over the blocks to forget before a search; x = 0 without one
    nodes: u32,         // blocks that the last search made active
    moved: f32,         // [m] the most that a particle can have moved since the last search
    skin: f32,          // [m] by how much the lists reach beyond 2 h
    searches: u32,      // since the frame began
}

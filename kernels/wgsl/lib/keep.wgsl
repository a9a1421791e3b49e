// Neighbour lists that are kept over several steps (Verlet 1967): they reach a skin further than needed, and hold until
// two particles can have come nearer to each other by that. What all do together brings none nearer, so motion counts
// against a common velocity.
struct Keep {
    groups: vec3u,      // workgroups of 64 particles of a step that searches; x = 0 in one that keeps its lists
    spent: atomic<u32>, // 1: the next step searches, whatever has moved
    clear: vec3u,       // workgroups over the blocks to forget before a search; x = 0 without one
    nodes: u32,         // blocks that the last search made active
    drift: vec3f,       // [m/s] what all have of their velocity in this step, about
    moved: f32,         // [m] the most that a particle can have moved beyond that since the last search
    low: array<atomic<u32>, 3>,     // least and largest velocity of a sample of this step, `ranked`
    high: array<atomic<u32>, 3>,
    apart: atomic<u32>, // bits of the largest |v − drift| of this step [m/s]
    skin: f32,          // [m] by how much the lists reach beyond 2 h
    searches: u32,      // since the frame began
}

// Finite numbers as words of the same order, and back.
fn ranked(x: f32) -> u32 {
    let b = bitcast<u32>(x);
    return select(b | 0x80000000u, ~b, (b >> 31u) == 1u);
}
fn unranked(r: u32) -> f32 {
    return bitcast<f32>(select(~r, r & 0x7fffffffu, (r >> 31u) == 1u));
}

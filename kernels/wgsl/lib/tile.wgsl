//! use lib/splat
// The image in tiles of 8 × 8 pixels, each with a list of the points that may reach it.

const TILE_SIZE: i32 = 8;   // [px]

// Size of the image, number of points and room in the lists.
struct Room {
    width: u32,         // [px]
    height: u32,        // [px]
    points: u32,
    room: u32,          // entries of `list`
}

// How long all lists together are, whether or not there was room for them.
struct Bins {
    total: atomic<u32>,
    wrapped: atomic<u32>,   // not 0: more than `total` can count
}

fn tiles_across(screen: Screen) -> u32 {
    return (screen.width + 7u) / 8u;
}

// First (xy) and last (zw) tile that a disc may reach; nothing when last < first.
fn tile_reach(s: vec4f, screen: Screen) -> vec4i {
    let to = reach(s, screen);
    if (to.z < to.x || to.w < to.y) { return vec4i(0, 0, -1, -1); }
    return to / TILE_SIZE;
}

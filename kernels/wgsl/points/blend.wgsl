//! use lib/nearest lib/texel
// The K nearest points of every pixel, blended. One workgroup a tile of 8 × 8 pixels, one lane a pixel. Eight points
// at a time: eight lanes load one each and broadcast it, every lane tests them into a bit mask, then only the hits
// are sorted in, since that is what costs. Needs subgroups of at least 8; else see `points/blend_shared`.
//! texels splats: vec4f
//! texels list: u32

struct Words { d: array<u32> }
struct Floats { d: array<f32> }
@group(0) @binding(0) var splats: texture_1d<u32>;
@group(0) @binding(1) var<storage, read> counts: Words;
@group(0) @binding(2) var<storage, read> ends: Words;
@group(0) @binding(3) var list: texture_1d<u32>;
@group(0) @binding(4) var<storage, read> colors: Words;      // RGBA8 of each point
@group(0) @binding(5) var<storage, read> objects: Words;     // object of each point
@group(0) @binding(6) var<storage, read_write> image: Words;     // RGBA8, 0 where nothing is
@group(0) @binding(7) var<storage, read_write> depths: Floats;   // nearest [m], 0 where nothing is
@group(0) @binding(8) var<storage, read_write> ids: Words;       // object of the nearest, 0 where nothing is
var<immediate> call: Room;

// Bit 0 when the pixel's centre is inside the disc.
fn test(s: vec4f, pixel: vec2u) -> u32 {
    let d = distances(s, pixel);
    return select(0u, 1u, d.x < d.y);
}

@compute @workgroup_size(64)
fn main(
    @builtin(workgroup_id) group: vec3u,
    @builtin(num_workgroups) groups: vec3u,
    @builtin(local_invocation_index) lane: u32,
    @builtin(subgroup_invocation_id) place: u32,
) {
    let screen = Screen(call.width, call.height, call.points);
    let across = tiles_across(screen);
    let tiles = across * ((call.height + 7u) / 8u);
    let turn = group.y * groups.x + group.x;
    if (turn >= tiles) { return; }
    let tile = tile_of(turn, tiles);
    let pixel = vec2u(tile % across, tile / across) * 8u + vec2u(lane % 8u, lane / 8u);
    let end = min(ends.d[tile], call.room);
    let begin = ends.d[tile] - counts.d[tile];
    var nearest = nobody();
    for (var next = begin; next < end; next += 8u) {
        var mine = vec4f(0.0);
        if (next + place % 8u < end) { mine = texel(splats, word(list, next + place % 8u)); }
        var hits = test(subgroupBroadcast(mine, 0u), pixel);
        hits |= test(subgroupBroadcast(mine, 1u), pixel) << 1u;
        hits |= test(subgroupBroadcast(mine, 2u), pixel) << 2u;
        hits |= test(subgroupBroadcast(mine, 3u), pixel) << 3u;
        hits |= test(subgroupBroadcast(mine, 4u), pixel) << 4u;
        hits |= test(subgroupBroadcast(mine, 5u), pixel) << 5u;
        hits |= test(subgroupBroadcast(mine, 6u), pixel) << 6u;
        hits |= test(subgroupBroadcast(mine, 7u), pixel) << 7u;
        while (hits != 0u) {
            let id = word(list, next + firstTrailingBit(hits));
            hits &= hits - 1u;
            let s = texel(splats, id);
            nearest = sorted_in(nearest, Hit(s.z, id, weight(distances(s, pixel))));
        }
    }
    write_pixel(nearest, pixel, screen);
}

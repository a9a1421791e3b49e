//! use lib/nearest
// `points/blend` without subgroups, same pixels. Points come 64 at a time: first each lane takes a point and marks the
// pixels of the tile it hits, then each lane takes a pixel and sorts in the points that hit it.

struct Splats { d: array<vec4f> }
struct Words { d: array<u32> }
struct Floats { d: array<f32> }
@group(0) @binding(0) var<storage, read> splats: Splats;
@group(0) @binding(1) var<storage, read> counts: Words;
@group(0) @binding(2) var<storage, read> ends: Words;
@group(0) @binding(3) var<storage, read> list: Words;
@group(0) @binding(4) var<storage, read> colors: Words;      // RGBA8 of each point
@group(0) @binding(5) var<storage, read> objects: Words;     // object of each point
@group(0) @binding(6) var<storage, read_write> image: Words;     // RGBA8, 0 where nothing is
@group(0) @binding(7) var<storage, read_write> depths: Floats;   // nearest [m], 0 where nothing is
@group(0) @binding(8) var<storage, read_write> ids: Words;       // object of the nearest, 0 where nothing is
var<immediate> call: Room;

var<workgroup> splat_of: array<vec4f, 64>;
var<workgroup> number_of: array<u32, 64>;
// For each pixel, which of the 64 points hit it.
var<workgroup> hits_low: array<atomic<u32>, 64>;
var<workgroup> hits_high: array<atomic<u32>, 64>;

fn mark(s: vec4f, lane: u32, corner: vec2i, screen: Screen) {
    let to = reach(s, screen) - vec4i(corner, corner);
    let first = max(to.xy, vec2i(0));
    let last = min(to.zw, vec2i(7));
    for (var y = first.y; y <= last.y; y++) {
        for (var x = first.x; x <= last.x; x++) {
            let d = distances(s, vec2u(corner + vec2i(x, y)));
            if (d.x >= d.y) { continue; }
            if (lane < 32u) {
                atomicOr(&hits_low[y * 8 + x], 1u << lane);
            } else {
                atomicOr(&hits_high[y * 8 + x], 1u << (lane - 32u));
            }
        }
    }
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let screen = Screen(call.width, call.height, call.points);
    let across = tiles_across(screen);
    let tiles = across * ((call.height + 7u) / 8u);
    let turn = group.y * groups.x + group.x;
    if (turn >= tiles) { return; }
    let tile = tile_of(turn, tiles);
    let corner = vec2u(tile % across, tile / across) * 8u;
    let pixel = corner + vec2u(lane % 8u, lane / 8u);
    let end = min(ends.d[tile], call.room);
    let begin = ends.d[tile] - counts.d[tile];
    var nearest = nobody();
    for (var next = begin; next < end; next += 64u) {
        if (next + lane < end) {
            let id = list.d[next + lane];
            let s = splats.d[id];
            number_of[lane] = id;
            splat_of[lane] = s;
            mark(s, lane, vec2i(corner), screen);
        }
        workgroupBarrier();
        var low = atomicExchange(&hits_low[lane], 0u);
        var high = atomicExchange(&hits_high[lane], 0u);
        while ((low | high) != 0u) {
            var j = firstTrailingBit(low);
            if (low != 0u) {
                low &= low - 1u;
            } else {
                j = firstTrailingBit(high) + 32u;
                high &= high - 1u;
            }
            let s = splat_of[j];
            nearest = sorted_in(nearest, Hit(s.z, number_of[j], weight(distances(s, pixel))));
        }
        workgroupBarrier();
    }
    write_pixel(nearest, pixel, screen);
}

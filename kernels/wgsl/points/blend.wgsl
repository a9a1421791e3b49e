//! use lib/tile lib/pixel
// The K nearest points of every pixel, blended. One workgroup a tile of 8 × 8 pixels, one lane a pixel. Points are
// tested 32 at a time into a bit mask, then only the hits are walked: on a device where all lanes of a subgroup walk
// together, sorting a point in costs far more than testing it. Order is by depth, then by number, whatever the
// order of the lists.

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

override K: u32 = 8u;                   // points blended at most, 1 to 8
override BLEND_DEPTH: f32 = 3e38;       // only points this close behind the nearest are blended [m]
override WANT_DEPTH: bool = false;
override WANT_IDS: bool = false;

struct Hit {
    z: f32,
    id: u32,
    w: f32,
}

const FAR: f32 = 3.4028235e38;

var<workgroup> splat_of: array<vec4f, 32>;
var<workgroup> number_of: array<u32, 32>;

// Keeps the nearer of the two and hands on the other.
fn keep(kept: ptr<function, Hit>, other: ptr<function, Hit>) {
    let a = *kept;
    let b = *other;
    let nearer = b.z < a.z || (b.z == a.z && b.id < a.id);
    (*kept).z = select(a.z, b.z, nearer);
    (*kept).id = select(a.id, b.id, nearer);
    (*kept).w = select(a.w, b.w, nearer);
    (*other).z = select(b.z, a.z, nearer);
    (*other).id = select(b.id, a.id, nearer);
    (*other).w = select(b.w, a.w, nearer);
}

fn add(b: ptr<function, Blend>, hit: Hit, limit: f32) {
    if (hit.id != NOTHING && hit.z <= limit) { blend_in(b, colors.d[hit.id], hit.w); }
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(num_workgroups) groups: vec3u, @builtin(local_invocation_index) lane: u32) {
    let screen = Screen(call.width, call.height, call.points);
    let across = tiles_across(screen);
    let tiles = across * ((call.height + 7u) / 8u);
    let turn = group.y * groups.x + group.x;
    if (turn >= tiles) { return; }
    // A device of few cores gives each a run of workgroups: interleave the halves of the image, which differ in work.
    let half = (tiles + 1u) / 2u;
    var tile = turn * 2u;
    if (turn >= half) { tile = (turn - half) * 2u + 1u; }
    let pixel = vec2u(tile % across, tile / across) * 8u + vec2u(lane % 8u, lane / 8u);
    let end = min(ends.d[tile], call.room);
    let begin = ends.d[tile] - counts.d[tile];

    // Single variables: an array indexed at run time would live in memory and takes drivers long to compile.
    var h0 = Hit(FAR, NOTHING, 0.0);
    var h1 = h0;
    var h2 = h0;
    var h3 = h0;
    var h4 = h0;
    var h5 = h0;
    var h6 = h0;
    var h7 = h0;
    var worst = FAR;
    for (var next = begin; next < end; next += 32u) {
        let here = min(32u, end - next);
        if (lane < here) {
            let id = list.d[next + lane];
            number_of[lane] = id;
            splat_of[lane] = splats.d[id];
        }
        workgroupBarrier();
        var hits = 0u;
        for (var j = 0u; j < here; j++) {
            let s = splat_of[j];
            let d = distances(s, pixel);
            hits |= select(0u, 1u, d.x < d.y && s.z <= worst) << j;
        }
        while (hits != 0u) {
            let j = firstTrailingBit(hits);
            hits &= hits - 1u;
            let s = splat_of[j];
            var hit = Hit(s.z, number_of[j], weight(distances(s, pixel)));
            keep(&h0, &hit);
            if (K > 1u) { keep(&h1, &hit); }
            if (K > 2u) { keep(&h2, &hit); }
            if (K > 3u) { keep(&h3, &hit); }
            if (K > 4u) { keep(&h4, &hit); }
            if (K > 5u) { keep(&h5, &hit); }
            if (K > 6u) { keep(&h6, &hit); }
            if (K > 7u) { keep(&h7, &hit); }
        }
        if (K == 1u) { worst = h0.z; }
        if (K == 2u) { worst = h1.z; }
        if (K == 3u) { worst = h2.z; }
        if (K == 4u) { worst = h3.z; }
        if (K == 5u) { worst = h4.z; }
        if (K == 6u) { worst = h5.z; }
        if (K == 7u) { worst = h6.z; }
        if (K == 8u) { worst = h7.z; }
        workgroupBarrier();
    }
    if (pixel.x >= call.width || pixel.y >= call.height) { return; }
    let at = pixel.y * call.width + pixel.x;
    var color = 0u;
    var depth = 0.0;
    var object = 0u;
    if (h0.id != NOTHING) {
        let limit = h0.z + BLEND_DEPTH;
        var b = Blend(vec3f(0.0), 0.0, 1.0);
        add(&b, h0, limit);
        add(&b, h1, limit);
        add(&b, h2, limit);
        add(&b, h3, limit);
        add(&b, h4, limit);
        add(&b, h5, limit);
        add(&b, h6, limit);
        add(&b, h7, limit);
        color = packed(b);
        depth = h0.z;
        if (WANT_IDS) { object = objects.d[h0.id]; }
    }
    image.d[at] = color;
    if (WANT_DEPTH) { depths.d[at] = depth; }
    if (WANT_IDS) { ids.d[at] = object; }
}

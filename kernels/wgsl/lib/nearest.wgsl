//! use lib/tile lib/pixel
// The K nearest points of one pixel, kept in order of depth, then of number, whatever the order they come in. Single
// members: an array indexed at run time would live in memory and takes drivers long to compile. The kernel that uses
// this binds `colors`, `objects`, `image`, `depths` and `ids`.

override K: u32 = 8u;                   // points blended at most, 1 to 8
override BLEND_DEPTH: f32 = 3e38;       // only points this close behind the nearest are blended [m]
override WANT_DEPTH: bool = false;
override WANT_IDS: bool = false;

struct Hit {
    z: f32,
    id: u32,
    w: f32,
}

struct Nearest {
    h0: Hit,
    h1: Hit,
    h2: Hit,
    h3: Hit,
    h4: Hit,
    h5: Hit,
    h6: Hit,
    h7: Hit,
}

struct Ordered {
    near: Hit,
    far: Hit,
}

fn nobody() -> Nearest {
    let none = Hit(3.4028235e38, NOTHING, 0.0);
    return Nearest(none, none, none, none, none, none, none, none);
}

fn order(a: Hit, b: Hit) -> Ordered {
    let swap = b.z < a.z || (b.z == a.z && b.id < a.id);
    let near = Hit(select(a.z, b.z, swap), select(a.id, b.id, swap), select(a.w, b.w, swap));
    let far = Hit(select(b.z, a.z, swap), select(b.id, a.id, swap), select(b.w, a.w, swap));
    return Ordered(near, far);
}

// With a point that hits the pixel sorted in.
fn sorted_in(n: Nearest, hit: Hit) -> Nearest {
    var m = n;
    var o = order(m.h0, hit);
    m.h0 = o.near;
    if (K > 1u) { o = order(m.h1, o.far); m.h1 = o.near; }
    if (K > 2u) { o = order(m.h2, o.far); m.h2 = o.near; }
    if (K > 3u) { o = order(m.h3, o.far); m.h3 = o.near; }
    if (K > 4u) { o = order(m.h4, o.far); m.h4 = o.near; }
    if (K > 5u) { o = order(m.h5, o.far); m.h5 = o.near; }
    if (K > 6u) { o = order(m.h6, o.far); m.h6 = o.near; }
    if (K > 7u) { o = order(m.h7, o.far); m.h7 = o.near; }
    return m;
}

fn add(b: ptr<function, Blend>, hit: Hit, limit: f32) {
    if (hit.id != NOTHING && hit.z <= limit) { blend_in(b, colors.d[hit.id], hit.w); }
}

// Blends them and writes the pixel.
fn write_pixel(n: Nearest, pixel: vec2u, screen: Screen) {
    if (pixel.x >= screen.width || pixel.y >= screen.height) { return; }
    let at = pixel.y * screen.width + pixel.x;
    var color = 0u;
    var depth = 0.0;
    var object = 0u;
    if (n.h0.id != NOTHING) {
        let limit = n.h0.z + BLEND_DEPTH;
        var b = Blend(vec3f(0.0), 0.0, 1.0);
        add(&b, n.h0, limit);
        add(&b, n.h1, limit);
        add(&b, n.h2, limit);
        add(&b, n.h3, limit);
        add(&b, n.h4, limit);
        add(&b, n.h5, limit);
        add(&b, n.h6, limit);
        add(&b, n.h7, limit);
        color = packed(b);
        depth = n.h0.z;
        if (WANT_IDS) { object = objects.d[n.h0.id]; }
    }
    image.d[at] = color;
    if (WANT_DEPTH) { depths.d[at] = depth; }
    if (WANT_IDS) { ids.d[at] = object; }
}

// The tile of a workgroup. A device of few cores gives each a run of workgroups: interleave the halves of the image,
// which differ in work.
fn tile_of(turn: u32, tiles: u32) -> u32 {
    let half = (tiles + 1u) / 2u;
    return select(turn * 2u, (turn - half) * 2u + 1u, turn >= half);
}

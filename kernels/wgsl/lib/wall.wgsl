//! use lib/collider lib/sph_kernel
//! family shape
// Obstacles as volume that a fluid's sums see (density maps, Koschier & Bender 2017): behind a surface the regular
// filling goes on in layers. Planes are exact; corners multiply what their planes leave free; a ball is a plane near it.

// Their numbers in the family `shape`.
const WALL_BOX: u32 = 3u;
const WALL_ROOM: u32 = 4u;

// What one obstacle adds to the fill at a point, its gradient [1/m], its outward normal, distance from it in h.
struct Wall { share: f32, slope: vec3f, normal: vec3f, d: f32 }

// Part of the filling between the faces of a slab of half width a that a point at coordinate x sees, and its derivative.
fn slab(x: f32, a: f32) -> vec2f {
    let at = abs(x);
    let slope = behind_slope(at - a) - behind_slope(at + a);
    return vec2f(behind(at - a) - behind(at + a), select(-slope, slope, x >= 0.0));
}

// r: place relative to the obstacle's centre, in its own axes.
fn wall(c: Collider, r: vec3f, h: f32) -> Wall {
    let hit = shape(c.shape, c, r);
    let d = hit.w / h;
    // Inside, the fill goes on growing, so that what got there is pushed out the shortest way.
    if (d < 0.0) { return Wall(0.5 + d * behind_slope(0.0), hit.xyz * (behind_slope(0.0) / h), hit.xyz, d); }
    if (c.shape != WALL_BOX && c.shape != WALL_ROOM) {
        return Wall(behind(d), hit.xyz * (behind_slope(d) / h), hit.xyz, d);
    }
    let x = slab(r.x / h, c.size.x / h);
    let y = slab(r.y / h, c.size.y / h);
    let z = slab(r.z / h, c.size.z / h);
    let inside = x.x * y.x * z.x;
    let slope = vec3f(x.y * y.x * z.x, x.x * y.y * z.x, x.x * y.x * z.y) / h;
    if (c.shape == WALL_BOX) { return Wall(inside, slope, hit.xyz, d); }
    return Wall(1.0 - inside, -slope, hit.xyz, d);
}

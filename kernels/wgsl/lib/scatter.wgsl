//! use lib/bspline lib/load lib/field lib/clock
// What one particle gives to the nodes around it: momentum and mass (APIC, Jiang 2015), and the impulse of its
// stress by the gradient of the B-spline itself (Stomakhin 2013) or by the MLS form (Hu 2018, eq. 16).

override TRUE_GRADIENT: bool = true;

struct Scatter {
    wx: vec3f, wy: vec3f, wz: vec3f,    // weights
    gx: vec3f, gy: vec3f, gz: vec3f,    // slopes per cell
    q: vec3f,                           // momentum at the base node [kg m/s]
    m: f32,
    ax: vec3f, ay: vec3f, az: vec3f,    // momentum per cell along each axis
    sx: vec3f, sy: vec3f, sz: vec3f,    // columns of -dt V0 τ / dx [kg m/s]
}

// base: first node of the particle's cell; sorting decides which that is where rounding could.
fn scatter(p: Particle, acceleration: vec3f, base: vec3f, origin: vec3f, dx: f32, dt: f32) -> Scatter {
    var s: Scatter;
    let inv = 1.0 / dx;
    let f = (p.x - origin) * inv - base;
    s.wx = bspline(f.x);
    s.wy = bspline(f.y);
    s.wz = bspline(f.z);
    let pinned = (p.tag & PINNED) != 0u;
    s.m = p.m * select(1.0, PIN_MASS, pinned);
    let free = select(1.0, 0.0, pinned);
    let m = p.m * free;
    let rate = -dt * inv * free;
    s.sx = rate * vec3f(p.c0.w, p.s.x, p.s.y);
    s.sy = rate * vec3f(p.s.x, p.c1.w, p.s.z);
    s.sz = rate * vec3f(p.s.y, p.s.z, p.c2.w);
    s.ax = (m * dx) * vec3f(p.c0.x, p.c1.x, p.c2.x);
    s.ay = (m * dx) * vec3f(p.c0.y, p.c1.y, p.c2.y);
    s.az = (m * dx) * vec3f(p.c0.z, p.c1.z, p.c2.z);
    if (TRUE_GRADIENT) {
        s.gx = bspline_slope(f.x);
        s.gy = bspline_slope(f.y);
        s.gz = bspline_slope(f.z);
    } else {
        s.ax += 4.0 * s.sx;
        s.ay += 4.0 * s.sy;
        s.az += 4.0 * s.sz;
    }
    s.q = m * (p.v + dt * acceleration) - (f.x * s.ax + f.y * s.ay + f.z * s.az);
    return s;
}

// What the three nodes of row (j, k) have in common, so that node i gets w_i (a + i b) + g_i c and mass w_i m.
struct ScatterRow { a: vec3f, m: f32, b: vec3f, c: vec3f }

fn scatter_row(s: Scatter, j: u32, k: u32) -> ScatterRow {
    let w = s.wy[j] * s.wz[k];
    var a = w * (s.q + f32(j) * s.ay + f32(k) * s.az);
    if (TRUE_GRADIENT) { a += (s.gy[j] * s.wz[k]) * s.sy + (s.wy[j] * s.gz[k]) * s.sz; }
    return ScatterRow(a, w * s.m, w * s.ax, w * s.sx);
}

// Share of node i of a row: momentum in xyz, mass in w. The indices are constants where it is called.
fn share(s: Scatter, r: ScatterRow, i: u32) -> vec4f {
    var momentum = s.wx[i] * (r.a + f32(i) * r.b);
    if (TRUE_GRADIENT) { momentum += s.gx[i] * r.c; }
    return vec4f(momentum, s.wx[i] * r.m);
}

// Every kernel that uses this binds `forces` as texels.
struct Forces {
    gravity: vec4f,     // [m/s²]
    count: u32,         // of the fields in use
    d: array<Field, 16>,
}

fn load_field(i: u32) -> Field {
    let at = 2u + 6u * i;
    let kinds = textureLoad(forces, at, 0);
    let times = bitcast<vec4f>(kinds);
    let p = texel(forces, at + 1u);
    return Field(kinds.x, kinds.y, times.z, times.w, p.x, p.y, p.z, p.w, texel(forces, at + 2u), texel(forces, at + 3u),
        texel(forces, at + 4u), texel(forces, at + 5u));
}

// Acceleration of the fields that act on a body, and gravity [m/s²].
fn body_acceleration(p: Particle, fields: u32, gravity: vec3f, count: u32, t: f32) -> vec3f {
    // A body whose weight is carried from the start feels no gravity beyond it.
    var a = select(gravity, vec3f(0.0), (fields & CARRIED) != 0u);
    for (var i = 0u; i < count; i++) {
        if (((fields >> i) & 1u) != 0u) { a += field_acceleration(load_field(i), p.x, p.v, t); }
    }
    return a;
}

//! use lib/bspline lib/load lib/force lib/clock
// What one particle gives to the nodes around it: momentum and mass (APIC, Jiang 2015), and the impulse of its
// stress by the gradient of the B-spline itself (Stomakhin 2013) or by the MLS form (Hu 2018, eq. 16).

override TRUE_GRADIENT: bool = true;

// The share of node (i, j, k) is w_i w_j w_k (q + i ax + j ay + k az) + g_i w_j w_k sx + w_i g_j w_k sy + w_i w_j g_k sz,
// with q the momentum at the first node, a_ the momentum gained per cell along an axis and s_ the columns of
// -dt V0 τ / dx. It falls into factors of single axes: w_i (w_k y_j + w_j z_k) + w_j w_k x_i.
struct Scatter {
    wx: vec3f, wy: vec3f, wz: vec3f,    // weights
    m: f32,                             // [kg]
    x: mat3x3f,                         // columns: w_i i ax + g_i sx [kg m/s]
    y: mat3x3f,                         // columns: w_j (q + j ay) + g_j sy
    z: mat3x3f,                         // columns: w_k k az + g_k sz
}

// base: first node of the particle's cell; sorting decides which that is where rounding could.
fn scatter(p: Particle, acceleration: vec3f, base: vec3f, origin: vec3f, dx: f32, dt: f32) -> Scatter {
    let inv = 1.0 / dx;
    let f = (p.x - origin) * inv - base;
    let pinned = (p.tag & PINNED) != 0u;
    let free = select(1.0, 0.0, pinned);
    let m = p.m * free;
    let rate = -dt * inv * free;
    let sx = rate * vec3f(p.c0.w, p.s.x, p.s.y);
    let sy = rate * vec3f(p.s.x, p.c1.w, p.s.z);
    let sz = rate * vec3f(p.s.y, p.s.z, p.c2.w);
    var ax = (m * dx) * vec3f(p.c0.x, p.c1.x, p.c2.x);
    var ay = (m * dx) * vec3f(p.c0.y, p.c1.y, p.c2.y);
    var az = (m * dx) * vec3f(p.c0.z, p.c1.z, p.c2.z);
    var gx = vec3f(0.0);
    var gy = vec3f(0.0);
    var gz = vec3f(0.0);
    if (TRUE_GRADIENT) {
        gx = bspline_slope(f.x);
        gy = bspline_slope(f.y);
        gz = bspline_slope(f.z);
    } else {
        ax += 4.0 * sx;
        ay += 4.0 * sy;
        az += 4.0 * sz;
    }
    let q = m * (p.v + dt * acceleration) - (f.x * ax + f.y * ay + f.z * az);
    let wx = bspline(f.x);
    let wy = bspline(f.y);
    let wz = bspline(f.z);
    return Scatter(wx, wy, wz, p.m * select(1.0, PIN_MASS, pinned),
        mat3x3f(gx.x * sx, wx.y * ax + gx.y * sx, (2.0 * wx.z) * ax + gx.z * sx),
        mat3x3f(wy.x * q + gy.x * sy, wy.y * (q + ay) + gy.y * sy, wy.z * (q + 2.0 * ay) + gy.z * sy),
        mat3x3f(gz.x * sz, wz.y * az + gz.y * sz, (2.0 * wz.z) * az + gz.z * sz));
}

// What the three nodes of row (j, k) have in common.
struct ScatterRow { a: vec3f, w: f32, m: f32 }

fn scatter_row(s: Scatter, j: u32, k: u32) -> ScatterRow {
    let w = s.wy[j] * s.wz[k];
    return ScatterRow(s.wz[k] * s.y[j] + s.wy[j] * s.z[k], w, w * s.m);
}

// Share of node i of a row: momentum in xyz, mass in w.
fn share(s: Scatter, r: ScatterRow, i: u32) -> vec4f {
    return vec4f(s.wx[i] * r.a + r.w * s.x[i], s.wx[i] * r.m);
}

// Acceleration of a particle of a body.
fn body_acceleration(p: Particle, fields: u32, gravity: vec3f, count: u32, t: f32) -> vec3f {
    return acceleration(fields, gravity, count, p.x, p.v, t);
}

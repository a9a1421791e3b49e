//! use lib/bspline lib/grid lib/particle lib/field lib/clock
// What one particle gives to the nodes around it: momentum and mass (APIC, Jiang 2015), and the impulse of its
// stress by the gradient of the B-spline itself (Stomakhin 2013) or by the MLS form (Hu 2018, eq. 16).

override TRUE_GRADIENT: bool = true;

struct Scatter {
    wx: vec3f, wy: vec3f, wz: vec3f,    // weights
    gx: vec3f, gy: vec3f, gz: vec3f,    // -dt · slopes [s/m]
    q: vec3f,                           // momentum at the base node [kg m/s]
    m: f32,
    ax: vec3f, ay: vec3f, az: vec3f,    // momentum per cell along each axis
    sx: vec3f, sy: vec3f, sz: vec3f,    // columns of V0 τ [J]
}

fn scatter(p: Particle, acceleration: vec3f, grid: Grid, dt: f32) -> Scatter {
    var s: Scatter;
    let f = (p.x - grid.origin) / grid.dx - base_node(grid, p.x);
    s.wx = bspline(f.x);
    s.wy = bspline(f.y);
    s.wz = bspline(f.z);
    let pinned = (p.tag & PINNED) != 0u;
    s.m = p.m * select(1.0, PIN_MASS, pinned);
    let free = select(1.0, 0.0, pinned);
    let stress = mat3x3f(vec3f(p.c0.w, p.s.x, p.s.y), vec3f(p.s.x, p.c1.w, p.s.z), vec3f(p.s.y, p.s.z, p.c2.w));
    var affine = transpose(mat3x3f(p.c0.xyz, p.c1.xyz, p.c2.xyz)) * (p.m * free * grid.dx);
    if (TRUE_GRADIENT) {
        let rate = -dt / grid.dx * free;
        s.gx = rate * bspline_slope(f.x);
        s.gy = rate * bspline_slope(f.y);
        s.gz = rate * bspline_slope(f.z);
        s.sx = stress[0];
        s.sy = stress[1];
        s.sz = stress[2];
    } else {
        affine -= (4.0 * dt * free / grid.dx) * stress;
    }
    s.ax = affine[0];
    s.ay = affine[1];
    s.az = affine[2];
    s.q = (p.m * free) * (p.v + dt * acceleration) - affine * f;
    return s;
}

// Share of node (i, j, k) of the stencil: momentum in xyz, mass in w. The indices are constants where it is called.
fn share(s: Scatter, i: u32, j: u32, k: u32) -> vec4f {
    let wyz = s.wy[j] * s.wz[k];
    let w = s.wx[i] * wyz;
    var momentum = w * (s.q + f32(i) * s.ax + f32(j) * s.ay + f32(k) * s.az);
    if (TRUE_GRADIENT) {
        momentum += (s.gx[i] * wyz) * s.sx + (s.wx[i] * s.gy[j] * s.wz[k]) * s.sy + (s.wx[i] * s.wy[j] * s.gz[k]) * s.sz;
    }
    return vec4f(momentum, w * s.m);
}

// Acceleration of the fields that act on a body, and gravity [m/s²].
fn body_acceleration(p: Particle, b: Body, t: f32, share: f32) -> vec3f {
    var a = forces.gravity.xyz;
    for (var i = 0u; i < forces.count; i++) {
        if (((b.fields >> i) & 1u) != 0u) { a += field_acceleration(forces.d[i], p.x, p.v, t); }
    }
    return share * a;
}

struct Forces {
    gravity: vec4f,     // [m/s²]
    count: u32,         // of the fields in use
    d: array<Field, 16>,
}

//! use lib/bspline lib/grid lib/clock lib/particle
//! family material
// Grid to particles: velocity and affine velocity (APIC), deformation by the gradient of the B-spline or the MLS
// form, position, and the stress for the next transfer. One lane a cell, whose 27 nodes it loads once.

override TRUE_GRADIENT: bool = true;
// A velocity gradient that would stretch a particle by more than this in one step is scaled back and counted.
override MAX_STRETCH: f32 = 0.5;
// Volume below which a particle is no longer compressed, as a share of its volume at rest.
override MIN_VOLUME: f32 = 0.05;

struct Particles { d: array<Particle> }
struct Bodies { d: array<Body> }
struct Words { d: array<u32> }
struct Deformations { d: array<Deformation> }
struct Nodes { d: array<vec4f> }
@group(0) @binding(0) var<storage, read_write> particles: Particles;
@group(0) @binding(1) var<storage, read_write> deformations: Deformations;
@group(0) @binding(2) var<storage, read> bodies: Bodies;
@group(0) @binding(3) var<storage, read> order: Words;
@group(0) @binding(4) var<storage, read> starts: Words;
@group(0) @binding(5) var<storage, read> counts: Words;
@group(0) @binding(6) var<storage, read> table: Words;
@group(0) @binding(7) var<storage, read> list: Words;
@group(0) @binding(8) var<storage, read> nodes: Nodes;
@group(0) @binding(9) var<storage, read_write> clock: Clock;
var<immediate> grid: Grid;

var<workgroup> tile: array<vec4f, TILE>;
var<workgroup> from_slot: array<u32, 8>;
var<workgroup> fastest: array<f32, 64>;

// Sums over one row of three nodes: value, slope along x, first moment along x.
struct Row { v: vec3f, g: vec3f, m: vec3f }

fn row(a: vec3f, b: vec3f, c: vec3f, w: vec3f, g: vec3f, d: vec3f) -> Row {
    let wd = w * d;
    return Row(w.x * a + w.y * b + w.z * c, g.x * a + g.y * b + g.z * c, wd.x * a + wd.y * b + wd.z * c);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read first: a software driver makes one load of a uniform address only before any branch.
    let dt = clock.dt;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    if (lane < 8u) {
        let at = block_coord(grid, list.d[slot]) + vec3u(lane & 1u, (lane >> 1u) & 1u, lane >> 2u);
        var found = NOWHERE;
        if (all(at < grid.blocks)) { found = table.d[block_index(grid, at)] - 1u; }
        from_slot[lane] = found;
    }
    workgroupBarrier();
    for (var i = lane; i < TILE; i += 64u) {
        let n = vec3u(i % 6u, (i / 6u) % 6u, i / 36u);
        let up = n >> vec3u(2u);
        let source = from_slot[up.z * 4u + up.y * 2u + up.x];
        let l = n & vec3u(3u);
        var node = vec4f(0.0);
        if (source < grid.capacity) { node = nodes.d[source * 64u + l.z * 16u + l.y * 4u + l.x]; }
        tile[i] = node;
    }
    workgroupBarrier();
    let at = (lane >> 4u) * 36u + ((lane >> 2u) & 3u) * 6u + (lane & 3u);
    let first = starts.d[slot * 64u + lane];
    let last = first + counts.d[slot * 64u + lane];
    var top = 0.0;
    if (first < last) {
        let n000 = tile[at + 0u].xyz;
        let n100 = tile[at + 1u].xyz;
        let n200 = tile[at + 2u].xyz;
        let n010 = tile[at + 6u].xyz;
        let n110 = tile[at + 7u].xyz;
        let n210 = tile[at + 8u].xyz;
        let n020 = tile[at + 12u].xyz;
        let n120 = tile[at + 13u].xyz;
        let n220 = tile[at + 14u].xyz;
        let n001 = tile[at + 36u].xyz;
        let n101 = tile[at + 37u].xyz;
        let n201 = tile[at + 38u].xyz;
        let n011 = tile[at + 42u].xyz;
        let n111 = tile[at + 43u].xyz;
        let n211 = tile[at + 44u].xyz;
        let n021 = tile[at + 48u].xyz;
        let n121 = tile[at + 49u].xyz;
        let n221 = tile[at + 50u].xyz;
        let n002 = tile[at + 72u].xyz;
        let n102 = tile[at + 73u].xyz;
        let n202 = tile[at + 74u].xyz;
        let n012 = tile[at + 78u].xyz;
        let n112 = tile[at + 79u].xyz;
        let n212 = tile[at + 80u].xyz;
        let n022 = tile[at + 84u].xyz;
        let n122 = tile[at + 85u].xyz;
        let n222 = tile[at + 86u].xyz;
        var current = NOWHERE;
        var body: Body;
        let origin = grid.origin;
        let inv = 1.0 / grid.dx;
        for (var i = first; i < last; i++) {
            let index = order.d[i];
            let tag = particles.d[index].tag;
            if ((tag & PINNED) != 0u) { continue; }
            if ((tag & BODY_MASK) != current) {    // rarely
                current = tag & BODY_MASK;
                body = bodies.d[current];
            }
            let x = particles.d[index].x;
            let place = (x - origin) * inv;
            let f = place - floor(place - vec3f(0.5));
            let wx = bspline(f.x);
            let wy = bspline(f.y);
            let wz = bspline(f.z);
            let gx = bspline_slope(f.x);
            let gy = bspline_slope(f.y);
            let gz = bspline_slope(f.z);
            let d = vec3f(0.0, 1.0, 2.0);
            let dy = wy * (d - f.y);
            let dz = wz * (d - f.z);
            var v = vec3f(0.0);
            var vx = vec3f(0.0);    // moments: columns of the affine velocity
            var vy = vec3f(0.0);
            var vz = vec3f(0.0);
            var lx = vec3f(0.0);    // slopes: columns of the velocity gradient
            var ly = vec3f(0.0);
            var lz = vec3f(0.0);
            let r00 = row(n000, n100, n200, wx, gx, d - f.x);
            let r01 = row(n010, n110, n210, wx, gx, d - f.x);
            let r02 = row(n020, n120, n220, wx, gx, d - f.x);
            let s0 = wy.x * r00.v + wy.y * r01.v + wy.z * r02.v;
            v += wz[0] * s0;
            vz += dz[0] * s0;
            lz += gz[0] * s0;
            vx += wz[0] * (wy.x * r00.m + wy.y * r01.m + wy.z * r02.m);
            vy += wz[0] * (dy.x * r00.v + dy.y * r01.v + dy.z * r02.v);
            lx += wz[0] * (wy.x * r00.g + wy.y * r01.g + wy.z * r02.g);
            ly += wz[0] * (gy.x * r00.v + gy.y * r01.v + gy.z * r02.v);
            let r10 = row(n001, n101, n201, wx, gx, d - f.x);
            let r11 = row(n011, n111, n211, wx, gx, d - f.x);
            let r12 = row(n021, n121, n221, wx, gx, d - f.x);
            let s1 = wy.x * r10.v + wy.y * r11.v + wy.z * r12.v;
            v += wz[1] * s1;
            vz += dz[1] * s1;
            lz += gz[1] * s1;
            vx += wz[1] * (wy.x * r10.m + wy.y * r11.m + wy.z * r12.m);
            vy += wz[1] * (dy.x * r10.v + dy.y * r11.v + dy.z * r12.v);
            lx += wz[1] * (wy.x * r10.g + wy.y * r11.g + wy.z * r12.g);
            ly += wz[1] * (gy.x * r10.v + gy.y * r11.v + gy.z * r12.v);
            let r20 = row(n002, n102, n202, wx, gx, d - f.x);
            let r21 = row(n012, n112, n212, wx, gx, d - f.x);
            let r22 = row(n022, n122, n222, wx, gx, d - f.x);
            let s2 = wy.x * r20.v + wy.y * r21.v + wy.z * r22.v;
            v += wz[2] * s2;
            vz += dz[2] * s2;
            lz += gz[2] * s2;
            vx += wz[2] * (wy.x * r20.m + wy.y * r21.m + wy.z * r22.m);
            vy += wz[2] * (dy.x * r20.v + dy.y * r21.v + dy.z * r22.v);
            lx += wz[2] * (wy.x * r20.g + wy.y * r21.g + wy.z * r22.g);
            ly += wz[2] * (gy.x * r20.v + gy.y * r21.v + gy.z * r22.v);
            var l = mat3x3f(vx, vy, vz) * (4.0 * inv);
            if (TRUE_GRADIENT) { l = mat3x3f(lx, ly, lz) * inv; }
            let size = dt * sqrt(dot(l[0], l[0]) + dot(l[1], l[1]) + dot(l[2], l[2]));
            if (size > MAX_STRETCH) {
                l *= MAX_STRETCH / size;
                atomicAdd(&clock.clamped_strain, 1u);
            }
            let def = deformations.d[index];
            let last_f = mat3x3f(def.f0.xyz, def.f1.xyz, def.f2.xyz);
            var next = last_f + dt * (l * last_f);
            if (dot(next[0], cross(next[1], next[2])) < MIN_VOLUME) {
                next = last_f;
                atomicAdd(&clock.clamped_volume, 1u);
            }
            let tau = def.f0.w * material(body.material, body, next).tau;
            particles.d[index].x = x + dt * v;
            particles.d[index].v = v;
            particles.d[index].c0 = vec4f(vx.x, vy.x, vz.x, tau[0].x) * vec4f(vec3f(4.0 * inv), 1.0);
            particles.d[index].c1 = vec4f(vx.y, vy.y, vz.y, tau[1].y) * vec4f(vec3f(4.0 * inv), 1.0);
            particles.d[index].c2 = vec4f(vx.z, vy.z, vz.z, tau[2].z) * vec4f(vec3f(4.0 * inv), 1.0);
            particles.d[index].s = vec4f(tau[1].x, tau[2].x, tau[2].y, 0.0);
            // A sum is finite only if all its terms are.
            if (!finite(next[0] + next[1] + next[2]) || !finite(tau[0] + tau[1] + tau[2])) {
                particles.d[index].tag = tag | QUARANTINED;
                atomicAdd(&clock.quarantined, 1u);
            }
            deformations.d[index] = Deformation(vec4f(next[0], def.f0.w), vec4f(next[1], 0.0), vec4f(next[2], 0.0));
            top = max(top, length(v));
        }
    }
    fastest[lane] = top;
    workgroupBarrier();
    if (lane == 0u) {
        for (var i = 1u; i < 64u; i++) { top = max(top, fastest[i]); }
        atomicMax(&clock.speed_bits, bitcast<u32>(top));
    }
}

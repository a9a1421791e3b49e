//! use lib/bspline lib/clock lib/load
//! family material
// Grid to particles: velocity and affine velocity (APIC), deformation by the gradient of the B-spline or the MLS
// form, position, and the stress for the next transfer. One lane an occupied cell, whose 27 nodes it loads once.
//! texels was: Particle
//! texels deformed: Deformation
//! texels bodies: Body
//! texels order: u32
//! texels occupied: Cell
//! texels links: u32
//! texels nodes: vec4f

override TRUE_GRADIENT: bool = true;
// A velocity gradient that would stretch a particle by more than this in one step is scaled back and counted.
override MAX_STRETCH: f32 = 0.5;
// Volume below which a particle is no longer compressed, as a share of its volume at rest.
override MIN_VOLUME: f32 = 0.05;

// Particles and deformations are read and written by the lane that owns their cell, in this order: `was` and
// `deformed` are the same buffers as `particles` (six vectors each) and `deformations`.
struct Vectors { d: array<vec4f> }
struct Deformations { d: array<Deformation> }
@group(0) @binding(0) var was: texture_1d<u32>;
@group(0) @binding(1) var<storage, read_write> particles: Vectors;
@group(0) @binding(2) var deformed: texture_1d<u32>;
@group(0) @binding(3) var<storage, read_write> deformations: Deformations;
@group(0) @binding(4) var bodies: texture_1d<u32>;
@group(0) @binding(5) var order: texture_1d<u32>;
@group(0) @binding(6) var occupied: texture_1d<u32>;
@group(0) @binding(7) var links: texture_1d<u32>;
@group(0) @binding(8) var nodes: texture_1d<u32>;
@group(0) @binding(9) var<storage, read> live: Counts;
@group(0) @binding(10) var<storage, read_write> clock: Clock;
var<immediate> grid: Grid;

var<workgroup> fastest: atomic<u32>;

// Sums over one row of three nodes: value, slope along x, first moment along x.
struct Row { v: vec3f, g: vec3f, m: vec3f }

fn row(a: vec3f, b: vec3f, c: vec3f, w: vec3f, g: vec3f, d: vec3f) -> Row {
    let wd = w * d;
    return Row(w.x * a + w.y * b + w.z * c, g.x * a + g.y * b + g.z * c, wd.x * a + wd.y * b + wd.z * c);
}

// Where the nodes of row (j, k) above cell l are: their slot, the slot one up in x, and their place in either.
fn line(low: vec4u, high: vec4u, l: vec3u, j: u32, k: u32) -> vec3u {
    let layer = select(low, high, l.z + k > 3u);
    return vec3u(select(layer.xy, layer.zw, l.y + j > 3u), ((l.z + k) & 3u) * 16u + ((l.y + j) & 3u) * 4u);
}

fn line_node(line: vec3u, i: u32) -> vec3f {
    return texel(nodes, select(line.x, line.y, i > 3u) * 64u + line.z + (i & 3u)).xyz;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read first: a software driver makes one load of a uniform address only before any branch.
    let dt = clock.dt;
    let cells = min(live.cells, grid.cells);
    var top = 0.0;
    if (id.x < cells) {
        let cell = load_cell(occupied, id.x);
        let last = cell.first + cell.count;
        let slot = cell.id >> 6u;
        let l = vec3u(cell.id & 3u, (cell.id >> 2u) & 3u, (cell.id >> 4u) & 3u);
        // Slots above: itself, then one up in x, y, xy, z, xz, yz, xyz.
        let low = textureLoad(links, slot * 4u + 2u, 0);
        let high = textureLoad(links, slot * 4u + 3u, 0);
        let l00 = line(low, high, l, 0u, 0u);
        let n000 = line_node(l00, l.x + 0u);
        let n100 = line_node(l00, l.x + 1u);
        let n200 = line_node(l00, l.x + 2u);
        let l10 = line(low, high, l, 1u, 0u);
        let n010 = line_node(l10, l.x + 0u);
        let n110 = line_node(l10, l.x + 1u);
        let n210 = line_node(l10, l.x + 2u);
        let l20 = line(low, high, l, 2u, 0u);
        let n020 = line_node(l20, l.x + 0u);
        let n120 = line_node(l20, l.x + 1u);
        let n220 = line_node(l20, l.x + 2u);
        let l01 = line(low, high, l, 0u, 1u);
        let n001 = line_node(l01, l.x + 0u);
        let n101 = line_node(l01, l.x + 1u);
        let n201 = line_node(l01, l.x + 2u);
        let l11 = line(low, high, l, 1u, 1u);
        let n011 = line_node(l11, l.x + 0u);
        let n111 = line_node(l11, l.x + 1u);
        let n211 = line_node(l11, l.x + 2u);
        let l21 = line(low, high, l, 2u, 1u);
        let n021 = line_node(l21, l.x + 0u);
        let n121 = line_node(l21, l.x + 1u);
        let n221 = line_node(l21, l.x + 2u);
        let l02 = line(low, high, l, 0u, 2u);
        let n002 = line_node(l02, l.x + 0u);
        let n102 = line_node(l02, l.x + 1u);
        let n202 = line_node(l02, l.x + 2u);
        let l12 = line(low, high, l, 1u, 2u);
        let n012 = line_node(l12, l.x + 0u);
        let n112 = line_node(l12, l.x + 1u);
        let n212 = line_node(l12, l.x + 2u);
        let l22 = line(low, high, l, 2u, 2u);
        let n022 = line_node(l22, l.x + 0u);
        let n122 = line_node(l22, l.x + 1u);
        let n222 = line_node(l22, l.x + 2u);
        var current = NOWHERE;
        var body: Body;
        let origin = grid.origin;
        let inv = 1.0 / grid.dx;
        for (var i = cell.first; i < last; i++) {
            let index = word(order, i);
            let head = texel(was, 6u * index);
            let tag = bitcast<u32>(head.w);
            if ((tag & PINNED) != 0u) { continue; }
            if ((tag & BODY_MASK) != current) {    // rarely
                current = tag & BODY_MASK;
                body = load_body(bodies, current);
            }
            let x = head.xyz;
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
            let def = load_deformation(deformed, index);
            let last_f = mat3x3f(def.f0.xyz, def.f1.xyz, def.f2.xyz);
            var next = last_f + dt * (l * last_f);
            if (dot(next[0], cross(next[1], next[2])) < MIN_VOLUME) {
                next = last_f;
                atomicAdd(&clock.clamped_volume, 1u);
            }
            let tau = def.f0.w * material(body.material, body, next).tau;
            // A sum is finite only if all its terms are.
            let lost = !finite(next[0] + next[1] + next[2]) || !finite(tau[0] + tau[1] + tau[2]);
            if (lost) { atomicAdd(&clock.quarantined, 1u); }
            let rate = vec4f(vec3f(4.0 * inv), 1.0);
            let at = 6u * index;
            particles.d[at] = vec4f(x + dt * v, bitcast<f32>(tag | select(0u, QUARANTINED, lost)));
            particles.d[at + 1u] = vec4f(v, texel(was, at + 1u).w);
            particles.d[at + 2u] = vec4f(vx.x, vy.x, vz.x, tau[0].x) * rate;
            particles.d[at + 3u] = vec4f(vx.y, vy.y, vz.y, tau[1].y) * rate;
            particles.d[at + 4u] = vec4f(vx.z, vy.z, vz.z, tau[2].z) * rate;
            particles.d[at + 5u] = vec4f(tau[1].x, tau[2].x, tau[2].y, 0.0);
            deformations.d[index] = Deformation(vec4f(next[0], def.f0.w), vec4f(next[1], 0.0), vec4f(next[2], 0.0));
            top = max(top, length(v));
        }
    }
    if (top > 0.0) { atomicMax(&fastest, bitcast<u32>(top)); }
    workgroupBarrier();
    if (lane == 0u) { atomicMax(&clock.speed_bits, atomicLoad(&fastest)); }
}

//! use lib/bspline lib/claim lib/clock lib/load
//! family material
// Grid to particles: velocity and affine velocity (APIC), deformation by the gradient of the B-spline or the MLS
// form, position, and the stress for the next transfer. One lane a particle: all of them in the order of their cells,
// or a stretch with one material in the order of their numbers, so that each material's particles pay for no other's.
// Then it finds the particle's new cell and claims its block, as `cells/locate` does. What sleeps stays as it is.
//! texels was: Particle
//! texels deformed: Deformation
//! texels bodies: Body
//! texels order: u32
//! texels cells: u32
//! texels claimed: u32
//! texels links: u32
//! texels nodes: vec4f

override TRUE_GRADIENT: bool = true;
// A velocity gradient that would stretch a particle by more than this in one step is scaled back and counted.
override MAX_STRETCH: f32 = 0.5;
// Volume below which a particle is no longer compressed, as a share of its volume at rest; one that is smaller or
// turned inside out may still recover.
override MIN_VOLUME: f32 = 0.05;
// All particles that are worked on, by their cells; else the stretch of them that the call names, by their numbers.
override ALL: bool = true;
// Cells are found by `cells/locate`, after something else has moved particles.
override LOCATES: bool = true;
// Nothing but liquid: of F only J is kept.
override LIQUID: bool = false;
// A liquid that expanded does not remember all of it: where the grid is denser than J says, J follows the grid by a tenth
// a step. Without that what splashes piles up to a fraction of its volume. Where other densities share the grid, its
// mass says less about the liquid: J is left alone below this share of it.
override PACKED: f32 = 0.0;
const FOLLOW: f32 = 0.1;

// Particles, deformations and keys are read and then written by their lane: `was`, `deformed` and `cells` are the same
// buffers as `particles` (six vectors each), `deformations` and `keys`; `claimed` is `table`.
struct Words { d: array<u32> }
struct AtomicWords { d: array<atomic<u32>> }
struct Vectors { d: array<vec4f> }
struct Deformations { d: array<Deformation> }
@group(0) @binding(0) var was: texture_1d<u32>;
@group(0) @binding(1) var<storage, read_write> particles: Vectors;
@group(0) @binding(2) var deformed: texture_1d<u32>;
@group(0) @binding(3) var<storage, read_write> deformations: Deformations;
@group(0) @binding(4) var bodies: texture_1d<u32>;
@group(0) @binding(5) var order: texture_1d<u32>;               // by cells, or the list of those that are worked on
@group(0) @binding(6) var cells: texture_1d<u32>;               // slot · 64 + cell
@group(0) @binding(7) var<storage, read_write> keys: Words;     // block · 64 + cell of the next substep
@group(0) @binding(8) var links: texture_1d<u32>;
@group(0) @binding(9) var nodes: texture_1d<u32>;
@group(0) @binding(10) var claimed: texture_1d<u32>;
@group(0) @binding(11) var<storage, read_write> table: AtomicWords;
@group(0) @binding(12) var<storage, read_write> list: Words;
@group(0) @binding(13) var<storage, read_write> live: Live;
@group(0) @binding(14) var<storage, read_write> clock: Clock;
var<immediate> grid: Grid;

var<workgroup> fastest: atomic<u32>;

// Weights of an axis, their slopes per cell, their first moments in cells.
struct Axis { w: vec3f, g: vec3f, m: vec3f }

// Sums over nodes: value; slopes along x, y, z; moments along x, y, z. A row uses those along x, a layer x and y.
struct Sums3 { v: vec3f, gx: vec3f, gy: vec3f, gz: vec3f, mx: vec3f, my: vec3f, mz: vec3f, mass: f32 }

fn axis(f: f32) -> Axis {
    let w = bspline(f);
    return Axis(w, bspline_slope(f), w * (vec3f(0.0, 1.0, 2.0) - f));
}

// Where the cell's nodes are: slots of its block and of the seven blocks above, the cell's place in its block.
struct Place { low: vec4u, high: vec4u, l: vec3u }

fn along_x(at: Place, y: u32, z: u32, x: Axis) -> Sums3 {
    let layer = select(at.low, at.high, z > 3u);
    let pair = select(layer.xy, layer.zw, y > 3u);
    let line = (z & 3u) * 16u + (y & 3u) * 4u;
    let a = texel(nodes, pair.x * 64u + line + at.l.x);
    let b = texel(nodes, select(pair.x, pair.y, at.l.x > 2u) * 64u + line + ((at.l.x + 1u) & 3u));
    let c = texel(nodes, select(pair.x, pair.y, at.l.x > 1u) * 64u + line + ((at.l.x + 2u) & 3u));
    var s: Sums3;
    s.v = x.w.x * a.xyz + x.w.y * b.xyz + x.w.z * c.xyz;
    s.gx = x.g.x * a.xyz + x.g.y * b.xyz + x.g.z * c.xyz;
    s.mx = x.m.x * a.xyz + x.m.y * b.xyz + x.m.z * c.xyz;
    s.mass = x.w.x * a.w + x.w.y * b.w + x.w.z * c.w;
    return s;
}

fn layer(at: Place, z: u32, x: Axis, y: Axis) -> Sums3 {
    let a = along_x(at, at.l.y, z, x);
    let b = along_x(at, at.l.y + 1u, z, x);
    let c = along_x(at, at.l.y + 2u, z, x);
    var s: Sums3;
    s.v = y.w.x * a.v + y.w.y * b.v + y.w.z * c.v;
    s.gx = y.w.x * a.gx + y.w.y * b.gx + y.w.z * c.gx;
    s.mx = y.w.x * a.mx + y.w.y * b.mx + y.w.z * c.mx;
    s.gy = y.g.x * a.v + y.g.y * b.v + y.g.z * c.v;
    s.my = y.m.x * a.v + y.m.y * b.v + y.m.z * c.v;
    s.mass = y.w.x * a.mass + y.w.y * b.mass + y.w.z * c.mass;
    return s;
}

fn block(at: Place, x: Axis, y: Axis, z: Axis) -> Sums3 {
    let a = layer(at, at.l.z, x, y);
    let b = layer(at, at.l.z + 1u, x, y);
    let c = layer(at, at.l.z + 2u, x, y);
    var s: Sums3;
    s.v = z.w.x * a.v + z.w.y * b.v + z.w.z * c.v;
    s.gx = z.w.x * a.gx + z.w.y * b.gx + z.w.z * c.gx;
    s.mx = z.w.x * a.mx + z.w.y * b.mx + z.w.z * c.mx;
    s.gy = z.w.x * a.gy + z.w.y * b.gy + z.w.z * c.gy;
    s.my = z.w.x * a.my + z.w.y * b.my + z.w.z * c.my;
    s.gz = z.g.x * a.v + z.g.y * b.v + z.g.z * c.v;
    s.mz = z.m.x * a.v + z.m.y * b.v + z.m.z * c.v;
    s.mass = z.w.x * a.mass + z.w.y * b.mass + z.w.z * c.mass;
    return s;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read first: a software driver makes one load of a uniform address only before any branch.
    let dt = clock.dt;
    let placed = select(clock.runs[grid.run].w, live.placed, ALL);
    let first = select(clock.starts[grid.run], 0u, ALL);
    if (id.x < placed) {
        let index = word(order, first + id.x);
        let head = texel(was, 6u * index);
        let tag = bitcast<u32>(head.w);
        if ((tag & QUARANTINED) == 0u) {
            // What is held or asleep stays where it is, or else finds its cell as it moves.
            var key = cell_key(head.xyz, vec3f(0.0));
            if ((tag & (PINNED | ASLEEP)) == 0u) { key = move_particle(index, head.xyz, tag, dt); }
            if (LOCATES) {
                keys.d[index] = key;
                if (key != NOWHERE) { claim(key >> 6u); }
            }
        }
    }
    workgroupBarrier();
    if (lane == 0u) { atomicMax(&clock.speed_bits, atomicLoad(&fastest)); }
}

// Answers the key of the particle's new cell.
fn move_particle(index: u32, x: vec3f, tag: u32, dt: f32) -> u32 {
    let inv = 1.0 / grid.dx;
    let key = word(cells, index);
    let slot = key >> 6u;
    let l = vec3u(key & 3u, (key >> 2u) & 3u, (key >> 4u) & 3u);
    let at = Place(textureLoad(links, slot * 6u + 2u, 0), textureLoad(links, slot * 6u + 3u, 0), l);
    // Sorting decided which cell it is in, where rounding could say another.
    let place = (x - grid.origin) * inv;
    let cell = floor(place - vec3f(0.5));
    let f = place - cell + vec3f(((vec3i(cell) - vec3i(l) + vec3i(1)) & vec3i(3)) - vec3i(1));
    let s = block(at, axis(f.x), axis(f.y), axis(f.z));
    var gradient = mat3x3f(s.mx, s.my, s.mz) * (4.0 * inv);
    if (TRUE_GRADIENT) { gradient = mat3x3f(s.gx, s.gy, s.gz) * inv; }
    let size = dt * sqrt(dot(gradient[0], gradient[0]) + dot(gradient[1], gradient[1]) + dot(gradient[2], gradient[2]));
    if (size > MAX_STRETCH) {
        gradient *= MAX_STRETCH / size;
        atomicAdd(&clock.clamped_strain, 1u);
    }
    let body = load_body(bodies, tag & BODY_MASK);
    let trial = try_step(index, body.material, gradient, dt, s.mass);
    let now = material(body.material, body, trial);
    let volume = texel(deformed, 3u * index).w;
    let tau = volume * now.tau;
    let next = now.f;
    // A sum is finite only if all its terms are. Return maps may make numbers of what was none, so the trial is asked.
    let lost = !finite(trial.f[0] + trial.f[1] + trial.f[2]) || !finite(tau[0] + tau[1] + tau[2]);
    let there = x + dt * s.v;
    let reached = select(cell_key(there, s.v), NOWHERE, lost);
    let gone = lost || (LOCATES && reached == NOWHERE);
    if (gone) { atomicAdd(&clock.quarantined, 1u); }
    if (gone && !lost && finite(there)) { atomicAdd(&clock.left, 1u); }
    let rate = vec4f(vec3f(4.0 * inv), 1.0);
    let to = 6u * index;
    particles.d[to] = vec4f(there, bitcast<f32>(tag | select(0u, QUARANTINED, gone)));
    particles.d[to + 1u] = vec4f(s.v, texel(was, to + 1u).w);
    particles.d[to + 2u] = vec4f(s.mx.x, s.my.x, s.mz.x, tau[0].x) * rate;
    particles.d[to + 3u] = vec4f(s.mx.y, s.my.y, s.mz.y, tau[1].y) * rate;
    particles.d[to + 4u] = vec4f(s.mx.z, s.my.z, s.mz.z, tau[2].z) * rate;
    particles.d[to + 5u] = vec4f(tau[1].x, tau[2].x, tau[2].y, 0.0);
    deformations.d[index].f0 = vec4f(next[0], volume);
    if (!LIQUID) {
        deformations.d[index].f1 = vec4f(next[1], now.memory);
        deformations.d[index].f2 = vec4f(next[2], 0.0);
    }
    let motion = length(s.v);
    if ((tag & WATCHED) != 0u && motion > clock.stir) { atomicAdd(&clock.stirred, 1u); }
    let speed = motion + body.wave * now.wave;
    if (speed > 0.0 && !gone) { atomicMax(&fastest, bitcast<u32>(speed)); }
    return reached;
}

// The deformation after the step if all of it were elastic; `mass` is what a cell holds where the particle is [kg].
fn try_step(index: u32, kind: u32, gradient: mat3x3f, dt: f32, mass: f32) -> Trial {
    if (LIQUID || (MATERIAL_LIQUID_USED && kind == MATERIAL_LIQUID)) {
        let old = texel(deformed, 3u * index);
        let last = old.x;
        var next = last * (1.0 + dt * (gradient[0].x + gradient[1].y + gradient[2].z));
        let packed = texel(was, 6u * index + 1u).w / old.w * grid.dx * grid.dx * grid.dx / mass;
        if (packed > PACKED * min(next, 1.0)) { next = min(next, next + FOLLOW * (packed - next)); }
        if (next < MIN_VOLUME && next <= last) {
            next = last;
            atomicAdd(&clock.clamped_volume, 1u);
        }
        return Trial(mat3x3f(vec3f(next, 0.0, 0.0), vec3f(0.0), vec3f(0.0)), 0.0, gradient);
    }
    let def = load_deformation(deformed, index);
    let last = mat3x3f(def.f0.xyz, def.f1.xyz, def.f2.xyz);
    var next = last + dt * (gradient * last);
    let volume = dot(next[0], cross(next[1], next[2]));
    if (volume < MIN_VOLUME && volume <= dot(last[0], cross(last[1], last[2]))) {
        next = last;
        atomicAdd(&clock.clamped_volume, 1u);
    }
    return Trial(next, def.f1.w, gradient);
}

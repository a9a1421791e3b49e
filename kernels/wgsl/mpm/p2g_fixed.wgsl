//! use lib/scatter
// Particles to grid with integer atomics in workgroup memory: a lane a particle, sums in fixed point, so that their
// order does not matter and no float atomics are needed. One workgroup a block.

//! texels particles: Particle
//! texels bodies: Body
//! texels order: u32
//! texels spans: vec2u
//! texels forces: Forces

struct Tiles { d: array<vec4f> }
@group(0) @binding(0) var particles: texture_1d<u32>;
@group(0) @binding(1) var bodies: texture_1d<u32>;
@group(0) @binding(2) var order: texture_1d<u32>;
@group(0) @binding(3) var spans: texture_1d<u32>;     // of each slot: first place, number of particles
@group(0) @binding(4) var<storage, read_write> tiles: Tiles;
@group(0) @binding(5) var<storage, read> clock: Clock;
@group(0) @binding(6) var forces: texture_1d<u32>;
var<immediate> grid: Grid;

// Momentum and mass of a node in units of a block's largest share, 2^20 steps each; 2,048 shares fit an i32.
const STEPS: f32 = 1048576.0;

var<workgroup> tile: array<atomic<i32>, 864>;
// Mass of pinned particles, in units PIN_MASS times as large: in those of the others nothing would be left of them.
var<workgroup> pinned: array<atomic<i32>, TILE>;
var<workgroup> scale_bits: atomic<u32>;
var<workgroup> mass_bits: atomic<u32>;

// Bound of a sum over one axis of a share; no weight is more than 1.
fn greatest(m: mat3x3f) -> vec3f {
    return max(abs(m[0]), max(abs(m[1]), abs(m[2])));
}

fn add(i: u32, x: vec4f) {
    // Rounded, not truncated: truncation would drain momentum.
    let n = vec4i(round(x));
    atomicAdd(&tile[4u * i], n.x);
    atomicAdd(&tile[4u * i + 1u], n.y);
    atomicAdd(&tile[4u * i + 2u], n.z);
    atomicAdd(&tile[4u * i + 3u], n.w);
}

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    // Read once and first: a software driver makes one load of a uniform address only before any branch.
    let origin = grid.origin;
    let dx = grid.dx;
    let dt = clock.dt;
    let time = clock.frame_start + clock.t;
    let field_count = textureLoad(forces, 0u, 0).x;
    let slot = group.x;
    if (slot >= grid.capacity) { return; }
    for (var i = lane; i < 4u * TILE; i += 64u) { atomicStore(&tile[i], 0); }
    for (var i = lane; i < TILE; i += 64u) { atomicStore(&pinned[i], 0); }
    let first = word(spans, 2u * slot);
    let last = first + word(spans, 2u * slot + 1u);
    // The block's largest momentum and mass set the units; maxima do not depend on order either.
    var top = 0.0;
    var heavy = 0.0;
    for (var i = first + lane; i < last; i += 64u) {
        let p = load_particle(particles, word(order, i));
        let body = load_body(bodies, p.tag & BODY_MASK);
        let a = body_acceleration(p, body.fields, body.gravity, field_count, time);
        let base = base_node(grid, p.x);
        let s = scatter(p, a, base, origin, dx, dt);
        let reach = greatest(s.x) + greatest(s.y) + greatest(s.z);
        top = max(top, max(reach.x, max(reach.y, reach.z)));
        heavy = max(heavy, p.m);
    }
    atomicMax(&scale_bits, bitcast<u32>(top));
    atomicMax(&mass_bits, bitcast<u32>(heavy));
    workgroupBarrier();
    // A block holds any number of particles, and all may reach one node: beyond 1,024 they get coarser steps.
    let steps = STEPS * min(1.0, 1024.0 / f32(max(last - first, 1u)));
    let unit = max(bitcast<f32>(atomicLoad(&scale_bits)), 1e-30);
    let weight = max(bitcast<f32>(atomicLoad(&mass_bits)), 1e-30);
    let to_steps = vec4f(vec3f(steps / unit), steps / weight);
    for (var i = first + lane; i < last; i += 64u) {
        let p = load_particle(particles, word(order, i));
        let body = load_body(bodies, p.tag & BODY_MASK);
        let a = body_acceleration(p, body.fields, body.gravity, field_count, time);
        let base = base_node(grid, p.x);
        let s = scatter(p, a, base, origin, dx, dt);
        let local = vec3u(base) & vec3u(3u);
        let at = local.z * 36u + local.y * 6u + local.x;
        for (var n = 0u; n < 27u; n++) {
            let o = vec3u(n % 3u, (n / 3u) % 3u, n / 9u);
            let node = at + o.z * 36u + o.y * 6u + o.x;
            let given = to_steps * share(s, scatter_row(s, o.y, o.z), o.x);
            if ((p.tag & PINNED) == 0u) {
                add(node, given);
            } else {
                atomicAdd(&pinned[node], i32(round(given.w / PIN_MASS)));
            }
        }
    }
    workgroupBarrier();
    for (var i = lane; i < TILE; i += 64u) {
        let n = vec4f(vec4i(atomicLoad(&tile[4u * i]), atomicLoad(&tile[4u * i + 1u]), atomicLoad(&tile[4u * i + 2u]), atomicLoad(&tile[4u * i + 3u])));
        let held = vec4f(0.0, 0.0, 0.0, PIN_MASS * f32(atomicLoad(&pinned[i])));
        tiles.d[slot * TILE + i] = (n + held) / to_steps;
    }
}

//! use lib/clock lib/reference lib/force lib/shock
// Moves the nodes: gathers the forces of the cells around each in a fixed order, adds gravity and fields, and steps by
// velocity Verlet: the kick of each step is half of the last and half of its own, so that with a last one of dt = 0 place
// and velocity are of the same time. A node behind a clamp moves by the opposite of its mirror image, and gives its force, reversed, to
// it. One lane a node.
//! texels nodes: ElasticNode
//! texels solids: Solid
//! texels shares: vec4f
//! texels u_was: vec4f
//! texels v_was: vec4f
//! texels forces: Forces

// Some nodes have mirror images. Without any, the second sum is left out: a software driver takes every branch.
// As a loop that ends after one turn it is slower still (12 ns of processor time a point of a cube for 10, without it 7).
override MIRRORED: bool = true;

// There is something to meet: what is fast takes steps in which it cannot pass it by. What is slow is seen by contact.
override MEETS: bool = false;

// Lighter nodes, as a share of a full one's mass, do not tell how fast a body is: at a ragged rim some carry a thousandth of
// it and fly to and fro at six times the speed of waves, which no point feels. One point by itself gives its nearest
// node 0.04.
const RIM: f32 = 0.03;

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var nodes: texture_1d<u32>;
@group(0) @binding(1) var solids: texture_1d<u32>;
@group(0) @binding(2) var shares: texture_1d<u32>;
@group(0) @binding(3) var forces: texture_1d<u32>;
// The same buffers, read and then written by their lane.
@group(0) @binding(4) var u_was: texture_1d<u32>;
@group(0) @binding(5) var v_was: texture_1d<u32>;
@group(0) @binding(6) var<storage, read_write> u: Vectors;      // displacement [m]
@group(0) @binding(7) var<storage, read_write> v: Vectors;      // velocity [m/s]; in w the last step [s]
@group(0) @binding(8) var<storage, read_write> clock: Clock;
var<immediate> reference: Reference;

// Share `slot` of a cell, if it is there.
fn share(slot: u32, cell: u32, there: u32) -> vec3f {
    let f = texel(shares, slot * reference.cells + min(cell, reference.cells - 1u)).xyz;
    return select(vec3f(0.0), f, there != 0u);
}

// From the three cells of a row; to the one below, the node is the upper of three.
fn from_row(row: u32, slot: u32) -> vec3f {
    let below = row & 1u;
    let at = (row >> 1u) & 1u;
    let first = row >> 3u;
    return share(slot + 2u, first, below) + share(slot + 1u, first + below, at)
        + share(slot, first + below + at, row & 4u);
}

fn gather(n: u32) -> vec3f {
    let a = textureLoad(nodes, 4u * n + 1u, 0);
    let b = textureLoad(nodes, 4u * n + 2u, 0);
    let c = textureLoad(nodes, 4u * n + 3u, 0);
    var f = from_row(a.z, 24u) + from_row(a.w, 21u) + from_row(b.x, 18u);
    f += from_row(b.y, 15u) + from_row(b.z, 12u) + from_row(b.w, 9u);
    f += from_row(c.x, 6u) + from_row(c.y, 3u) + from_row(c.z, 0u);
    return f;
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    // Read once and first: a software driver makes one load of a uniform address only before any branch.
    let dt = clock.dt;
    let time = clock.frame_start + clock.t;
    let forced = clock.force_dt > 0.0;
    let dx = clock.dx;
    let field_count = textureLoad(forces, 0u, 0).x;
    let n = id.x;
    if (n >= reference.nodes) { return; }
    let head = texel(nodes, 4u * n);
    let tag = bitcast<u32>(head.w);
    if ((tag & HELD) != 0u) { return; }
    let more = textureLoad(nodes, 4u * n + 1u, 0);
    var f = gather(n);
    if (MIRRORED && more.y != NOBODY) { f -= gather(more.y); }
    var was = texel(u_was, n).xyz;
    let last = texel(v_was, n);
    let before = last.xyz;
    let solid = load_solid(solids, tag & BODY_MASK);
    let a = acceleration(solid.fields, solid.gravity, field_count, head.xyz + was, before, time);
    var now = before + 0.5 * (last.w + dt) * (f / bitcast<f32>(more.x) + a);
    if (!finite(was + dt * now)) {
        atomicAdd(&clock.quarantined, 1u);
        now = vec3f(0.0);
        if (!finite(was)) { was = now; }
    }
    // A step that is forced beyond its limit would double everything to infinity: no more than 0.9 cells a step.
    let speed = length(now);
    let most = 0.9 * dx / max(dt, last.w);
    if (forced && speed > most) {
        atomicAdd(&clock.clamped_velocity, 1u);
        now *= most / speed;
    }
    let heavy = bitcast<f32>(more.x) > RIM * solid.density * pow(reference.dx, 3.0);
    if (MEETS && heavy && speed > CALM * solid.wave) {
        atomicMax(&clock.speed_bits, bitcast<u32>(max(clock.wave_speed, solid.wave) + speed));
    }
    let moved = was + dt * now;
    v.d[n] = vec4f(now, dt);
    u.d[n] = vec4f(moved, 0.0);
    if (more.y != NOBODY) {
        v.d[more.y] = vec4f(-now, 0.0);
        u.d[more.y] = vec4f(-moved, 0.0);
    }
}

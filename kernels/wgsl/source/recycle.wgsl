//! use lib/clock lib/hash lib/particle lib/texel lib/work
// Particles inside the region of their body's return go back to its source, in the state of the start: undeformed, at the
// body's velocity, at a random place of the source; or they are taken out, for an emitter to send them again. Comes before
// the sort, which takes out what has left the grid.
//! texels was: Particle
//! texels returns: Return
//! texels awake: u32

// Where the particles of a body return from and to.
struct Return {
    region: u32,        // 0: they do not, 1: from a box, 2: from a ball
    solid: f32,         // 1: F of the start is I; 0: that of a liquid, J alone
    stream: u32,        // chooses the random places
    drains: u32,        // 1: they wait for their emitter instead
    region_min: vec4f,  // box corner, or centre of the ball
    region_max: vec4f,  // box corner, or radius in x
    source_min: vec4f,
    source_max: vec4f,
    velocity: vec4f,    // [m/s]
    gravity: vec4f,     // [m/s²] that acts on the body
}

struct Particles { d: array<Particle> }
struct Deformations { d: array<Deformation> }
struct Words { d: array<u32> }
struct Tally { recycled: atomic<u32> }
@group(0) @binding(0) var<storage, read_write> particles: Particles;
@group(0) @binding(1) var<storage, read_write> deformations: Deformations;
@group(0) @binding(2) var<storage, read_write> turns: Words;     // how often each has returned
@group(0) @binding(3) var<storage, read_write> tally: Tally;
@group(0) @binding(4) var<storage, read_write> clock: Clock;
@group(0) @binding(5) var was: texture_1d<u32>;                 // the particles, read
@group(0) @binding(6) var returns: texture_1d<u32>;
@group(0) @binding(7) var awake: texture_1d<u32>;           // numbers of the particles that are worked on

@compute @workgroup_size(64)
fn main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_index) lane: u32) {
    let i = group.x * 64u + lane;
    if (i >= clock.particles - clock.idle) { return; }
    let p = word(awake, i);
    let head = texel(was, 6u * p);
    let tag = bitcast<u32>(head.w);
    let at = 7u * (tag & BODY_MASK);
    let kind = textureLoad(returns, at, 0);
    if (kind.x == 0u || (tag & (PINNED | QUARANTINED)) != 0u) { return; }
    let low = texel(returns, at + 1u).xyz;
    let high = texel(returns, at + 2u).xyz;
    let x = head.xyz;
    // Comparisons that NaN fails: what is not finite is left to the sort, which takes it out.
    let boxed = all(x >= low) && all(x <= high);
    let round = distance(x, low) <= high.x;
    if (!select(round, boxed, kind.x == 1u)) { return; }
    atomicAdd(&tally.recycled, 1u);
    let moved = texel(was, 6u * p + 1u);
    let gravity = texel(returns, at + 6u).xyz;
    // Kinetic energy and that of gravity; what it held by its deformation was its own, and is gone.
    let before = 0.5 * dot(moved.xyz, moved.xyz) - dot(gravity, x);
    if (kind.w != 0u) {
        if (COUNTS_WORK) { count_work(-moved.w * before); }
        particles.d[p].tag = tag | DORMANT | QUARANTINED;
        return;
    }
    let turn = turns.d[p];
    turns.d[p] = turn + 1u;
    let unit = vec3f(pcg4d(vec4u(p, turn, kind.z, 0u)).xyz >> vec3u(8u)) / 16777216.0;
    let from_low = texel(returns, at + 3u).xyz;
    let to = from_low + unit * (texel(returns, at + 4u).xyz - from_low);
    let still = vec4f(0.0);
    let v = texel(returns, at + 5u).xyz;
    if (COUNTS_WORK) { count_work(moved.w * (0.5 * dot(v, v) - dot(gravity, to) - before)); }
    particles.d[p] = Particle(to, tag, v, moved.w, still, still, still, still);
    let solid = bitcast<f32>(kind.y);
    deformations.d[p].f0 = vec4f(1.0, 0.0, 0.0, deformations.d[p].f0.w);
    deformations.d[p].f1 = vec4f(0.0, solid, 0.0, 0.0);
    deformations.d[p].f2 = vec4f(0.0, 0.0, solid, 0.0);
}

//! use lib/sph lib/keep
// Particle shifting (Xu, Stansby & Laurence 2009; with a stiffer push of what is near, as Monaghan 2000 has
// it against pairs): each goes down the slope of how crowded its place is, so that neighbours lie alike in all directions
// and pressure bears no shear. Velocities stay: a shift is no motion, and `debts` keep it from being a compression. One
// lane a particle.
//! texels places: vec4f
//! texels lists: u32
//! texels crowds: Crowd
//! texels locals: Local
//! texels numbers: u32

struct Vectors { d: array<vec4f> }
struct Debts { d: array<Debt> }
@group(0) @binding(0) var places: texture_1d<u32>;      // x [m], density at rest [kg/m³]
@group(0) @binding(1) var lists: texture_1d<u32>;
@group(0) @binding(2) var crowds: texture_1d<u32>;
@group(0) @binding(3) var locals: texture_1d<u32>;
@group(0) @binding(4) var numbers: texture_1d<u32>;
@group(0) @binding(5) var<storage, read> live: Counts;
@group(0) @binding(6) var<storage, read> clock: Clock;
@group(0) @binding(7) var<storage, read_write> spread: Vectors;    // as `places`
@group(0) @binding(8) var<storage, read_write> debts: Debts;
@group(0) @binding(9) var<storage, read_write> keep: Keep;
var<immediate> grid: Grid;

// It goes by so many h times the way of the fastest, beyond what all move, times the slope of the fill; by no more h² times
// that slope than it stands, and no further than so many h.
const PACE: f32 = 6.0;
const MOST: f32 = 0.06;
const FARTHEST: f32 = 0.05;
// How much of a debt is forgiven while sound goes h, however long steps are.
const FORGIVEN: f32 = 4e-4;
// By how much more those push that are near: 1 + NEAR (W/W(h))².
const NEAR: f32 = 1.0;
// A particle with less around it than this is spray, and goes its own way.
const SPRAY: f32 = 0.75;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let stride = clock.particles;
    let placed = live.cursor;
    let h = h_of();
    let inv_h = 1.0 / h;
    let i = id.x;
    if (i >= placed) { return; }
    let here = texel(places, i);
    let own = load_local(locals, i);
    let count = load_crowd(crowds, i).count;
    let number = word(numbers, i);
    var slope = h * own.wall;
    var push = slope;
    var fill = spline(0.0);
    for (var n = 0u; n < count; n += 4u) {
        let four = listed(lists, stride, i, n);
        for (var k = 0u; k < 4u; k++) {
            let j = select(select(four.x, four.y, k == 1u), select(four.z, four.w, k == 3u), k > 1u);
            let d = (here.xyz - texel(places, j).xyz) * inv_h;
            let q = max(length(d), 1e-6);
            // What fills up the last four is the particle itself.
            let w = select(spline(q), 0.0, j == i);
            let g = d * (spline_slope(q) / q);
            let near = w / spline(1.0);
            slope += g;
            push += g * (1.0 + NEAR * near * near);
            fill += w;
        }
    }
    let speed = bitcast<f32>(min(atomicLoad(&keep.apart), 0x7f7fffffu));
    var way = -min(PACE * clock.dt * speed * inv_h, MOST) * push;
    // Nothing leaves a free surface along its normal, or draws it in.
    let steep = length(slope);
    let normal = slope / max(steep, 1e-20);
    way -= normal * (dot(normal, way) * (1.0 - inside_of(steep)));
    // Where pressure is high for how fast it flows, what a shift leaves unbalanced would stir the liquid more than it flows.
    let debt = debts.d[number];
    way *= min(1.0, speed * speed / max(abs(debt.head), 1e-20));
    way *= min(1.0, FARTHEST / max(length(way), 1e-20));
    let led = (own.tag & (PINNED | LED)) != 0u;
    if (led || own.fill < SPRAY) { way = vec3f(0.0); }
    debts.d[number].owed = select(debt.owed * max(1.0 - FORGIVEN * clock.wave_speed * clock.dt * inv_h, 0.0), 0.0, led);
    debts.d[number].noted = select(fill, 0.0, led);
    spread.d[i] = vec4f(here.xyz + h * way, here.w);
}

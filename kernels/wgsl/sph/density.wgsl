//! use lib/sph
// Sums over each particle's neighbours: its fill s = V Σ W, that is its density over that at rest (Solenthaler & Pajarola
// 2008), the gradient of that, and how pressures of its neighbours act on it. One lane a particle.
//! texels places: vec4f
//! texels lists: u32
//! texels found: u32

struct Crowds { d: array<Crowd> }
@group(0) @binding(0) var places: texture_1d<u32>;
@group(0) @binding(1) var lists: texture_1d<u32>;
@group(0) @binding(2) var found: texture_1d<u32>;
@group(0) @binding(3) var<storage, read> live: Counts;
@group(0) @binding(4) var<storage, read> clock: Clock;
@group(0) @binding(5) var<storage, read_write> crowds: Crowds;
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let stride = clock.particles;
    let placed = live.cursor;
    let inv_h = 1.0 / h_of();
    let i = id.x;
    if (i >= placed) { return; }
    let x = texel(places, i).xyz;
    let count = word(found, i);
    var slope = vec3f(0.0);
    var fill = spline(0.0);
    var coupling = 0.0;
    for (var n = 0u; n < count; n += 4u) {
        let four = listed(lists, stride, i, n);
        for (var k = 0u; k < 4u; k++) {
            let j = select(select(four.x, four.y, k == 1u), select(four.z, four.w, k == 3u), k > 1u);
            let other = texel(places, j);
            let d = x - other.xyz;
            let r = length(d);
            let q = r * inv_h;
            let g = spline_slope(q) * inv_h;
            // Two at the same place push neither.
            slope += d * (g / max(r, 1e-20));
            // What fills up the last four is the particle itself.
            fill += select(spline(q), 0.0, j == i);
            coupling += g * g / other.w;
        }
    }
    crowds.d[i] = Crowd(slope, fill, coupling, count, vec2u(0u));
}

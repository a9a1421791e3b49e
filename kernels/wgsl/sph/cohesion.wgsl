//! use lib/sph
// Surface tension, as the forces of an energy of the density field (van der Waals' square-gradient theory, as Cahn &
// Hilliard 1958 have it):
//     E = V Σ τ_i/h (G/2 h² |∇s_i|² − s_i) + Σ over pairs of the potential of the force τ C(r)
// ∇s is large at a free surface only, and charges for its area. The second part holds the surface together, which would
// lower its first by evaporating; within the fluid it is but a pressure, which the solver takes up. The third, the cohesion of
// Akinci, Akinci & Teschner 2013 (eq. 2), keeps particles of the surface apart. Pairs of forces are opposite and the
// energy knows no place and no direction, so momentum and angular momentum stay. One lane a particle.
//! texels places: vec4f
//! texels moves: vec4f
//! texels lists: u32
//! texels crowds: Crowd
//! texels bodies: Body
//! texels around: Local

struct Locals { d: array<Local> }
@group(0) @binding(0) var places: texture_1d<u32>;
@group(0) @binding(1) var moves: texture_1d<u32>;
@group(0) @binding(2) var lists: texture_1d<u32>;
@group(0) @binding(3) var crowds: texture_1d<u32>;
@group(0) @binding(4) var bodies: texture_1d<u32>;
@group(0) @binding(5) var around: texture_1d<u32>;      // the same as `locals`, read
@group(0) @binding(6) var<storage, read> live: Counts;
@group(0) @binding(7) var<storage, read> clock: Clock;
@group(0) @binding(8) var<storage, read_write> locals: Locals;     // their `drive` and `power` grow
var<immediate> grid: Grid;

// τ over the surface tension: measured by the period of drops, 0.97 and 0.98 of Rayleigh's at radii of 7 h and 8 h (0.87
// to 0.99 at 6 h); tests/tests/sph/drop.rs.
const UNIT: f32 = 0.55;
const GRADIENT: f32 = 4.0;      // G
const COHESION: f32 = 0.4;      // size of C at its peak [τ]
// A wall pulls as the liquid that it stands for would, so that it neither attracts nor repels: the pressure of both
// attractions in a regular filling, 1 + COHESION/6 Σ q C(q) [τ/h].
const WALL: f32 = 2.1355743;

// τ of a particle [N/m], and h ∇s: what walls stand for is no surface.
struct Skin { tension: f32, slope: vec3f }

fn skin(i: u32, h: f32) -> Skin {
    let tag = bitcast<u32>(texel(moves, i).w);
    let tension = UNIT * texel(bodies, 3u * (tag & BODY_MASK) + 1u).x;
    return Skin(tension, h * (texel(crowds, 2u * i).xyz + 0.5 * texel(around, 5u * i).xyz));
}

// Akinci's spline over a reach of 2 h, 1 at its peak q = 1: pulls, but pushes where q < 0.55.
fn cohesion(q: f32) -> f32 {
    let a = (2.0 - q) * q;
    let cube = select(0.0, a * a * a, q < 2.0);
    return select(2.0 * cube - 1.0, cube, q > 1.0);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let stride = clock.particles;
    let placed = live.cursor;
    let h = h_of();
    let inv_h = 1.0 / h;
    let i = id.x;
    if (i >= placed) { return; }
    let here = texel(places, i);
    let own = skin(i, h);
    let count = load_crowd(crowds, i).count;
    // Force on it [τ h].
    var force = vec3f(0.0);
    for (var n = 0u; n < count; n += 4u) {
        let four = listed(lists, stride, i, n);
        for (var k = 0u; k < 4u; k++) {
            let j = select(select(four.x, four.y, k == 1u), select(four.z, four.w, k == 3u), k > 1u);
            if (j == i) { continue; }
            let other = skin(j, h);
            let d = (here.xyz - texel(places, j).xyz) * inv_h;
            let q = max(length(d), 1e-6);
            let e = d / q;
            let g = spline_slope(q);
            // Second derivatives of W across e and along it.
            let across = g / q;
            let along = spline_bend(q);
            let step = GRADIENT * (own.tension * own.slope - other.tension * other.slope);
            force += e * ((own.tension + other.tension) * (g / STEEP - 0.5 * COHESION * cohesion(q)));
            force -= across * step + e * ((along - across) * dot(e, step));
        }
    }
    let walls = WALL * own.tension * inv_h / here.w * texel(around, 5u * i);
    locals.d[i].drive += force * (inv_h * inv_h / here.w) + walls.xyz;
    locals.d[i].power += walls.w;
}

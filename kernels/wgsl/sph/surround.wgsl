//! use lib/sph lib/wall lib/forces
// What a particle meets besides its neighbours: walls, gravity and fields; in WCSPH its pressure too, by Tait's
// equation of state p = ρ c²/7 (s⁷ − 1), never negative: a free surface does not pull. One lane a particle.
//! texels places: vec4f
//! texels moves: vec4f
//! texels crowds: Crowd
//! texels bodies: Body
//! texels forces: Forces
//! texels colliders: Colliders

struct Vectors { d: array<vec4f> }
struct Locals { d: array<Local> }
@group(0) @binding(0) var places: texture_1d<u32>;
@group(0) @binding(1) var moves: texture_1d<u32>;
@group(0) @binding(2) var crowds: texture_1d<u32>;
@group(0) @binding(3) var bodies: texture_1d<u32>;
@group(0) @binding(4) var forces: texture_1d<u32>;
@group(0) @binding(5) var colliders: texture_1d<u32>;
@group(0) @binding(6) var<storage, read> live: Counts;
@group(0) @binding(7) var<storage, read> clock: Clock;
@group(0) @binding(8) var<storage, read_write> points: Vectors;    // x [m], P = p/s² [Pa]
@group(0) @binding(9) var<storage, read_write> flows: Vectors;    // v [m/s], sqrt(μ)/s, μ the viscosity [Pa s]
@group(0) @binding(10) var<storage, read_write> locals: Locals;
var<immediate> grid: Grid;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let placed = live.cursor;
    let time = clock.frame_start + clock.t;
    let sound = clock.wave_speed;
    let gravity = texel(forces, 0u).xyz;
    let field_count = textureLoad(forces, 1u, 0).x;
    let collider_count = textureLoad(colliders, 0u, 0).x;
    let h = h_of();
    let i = id.x;
    if (i >= placed) { return; }
    let place = texel(places, i);
    let motion = texel(moves, i);
    let crowd = load_crowd(crowds, i);
    let density = place.w;
    let tag = bitcast<u32>(motion.w);
    let body = textureLoad(bodies, tag & BODY_MASK, 0);
    let viscosity = bitcast<f32>(body.z);
    var p: Particle;
    p.x = place.xyz;
    p.v = motion.xyz;
    let drive = body_acceleration(p, body.y, gravity, field_count, time);
    var free = 1.0;
    var slope = vec3f(0.0);
    var drift = 0.0;
    var lift = vec3f(0.0);
    var slide = vec3f(0.0);
    var friction = 0.0;
    var drag = 0.0;
    var weight = 0.0;
    for (var k = 0u; k < collider_count; k++) {
        let c = load_collider(k);
        let moving = clamp(time, c.start, c.end) - c.start;
        let r = p.x - (c.center.xyz + c.velocity.xyz * moving);
        let rate = length(c.spin.xyz);
        let axis = select(vec3f(0.0, 0.0, 1.0), c.spin.xyz / max(rate, 1e-20), rate > 0.0);
        let w = wall(c, rotate(r, axis, -rate * moving), h);
        let size = length(w.slope);
        if (size > 0.0) {
            let running = time >= c.start && time < c.end;
            let speed = select(vec3f(0.0), c.velocity.xyz + cross(c.spin.xyz, r), running);
            let g = rotate(w.slope, axis, rate * moving);
            let n = rotate(w.normal, axis, rate * moving);
            drift += dot(speed, g);
            slope += g;
            free *= max(1.0 - w.share, 0.0);
            // The fluid that the wall stands for has weight: its pressure rises with depth (Adami 2012). Not above one.
            lift += n * (min(dot(drive, n), 0.0) * behind_moment(max(w.d, 0.0)));
            // A sticking wall goes on with the fluid's shear, so that the velocity is the wall's at its surface.
            if (c.sticky != 0u) { drag -= 2.0 * viscosity * behind_slope(w.d) / (max(w.d, 0.25) * h * h); }
            slide += speed * size;
            friction += select(c.friction, 0.0, c.sticky != 0u) * size;
            weight += size;
        }
    }
    let fill = crowd.fill + 1.0 - free;
    let share = 1.0 / max(weight, 1e-20);
    let around = crowd.slope;
    let response = max(dot(around + slope, around / STEEP + 2.0 * slope), 0.0) / density + crowd.coupling / STEEP;
    let s3 = fill * fill * fill;
    let pressure = density * sound * sound / 7.0 * max(s3 * s3 * fill - 1.0, 0.0) / (fill * fill);
    points.d[i] = vec4f(place.xyz, pressure);
    flows.d[i] = vec4f(motion.xyz, sqrt(viscosity * density) / fill);
    locals.d[i] = Local(slope, drift, drive + lift, fill, slide * share, friction * share, response, drag, density, tag);
}

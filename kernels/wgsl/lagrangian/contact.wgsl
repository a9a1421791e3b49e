//! use lib/clock lib/polar lib/touch lib/shock lib/give lib/work
// Contact of the surface with the obstacles: a pressure for the depth of each face, which grows faster where it is
// deep, and that of a shock; and a spring along the surface that slips by Coulomb's law (Cundall & Strack 1979). Faces
// are half a spacing from their points; where they are follows exactly from the value and two derivatives at the point.
// One lane a point.
//! texels cells: ElasticCell
//! texels solids: Solid
//! texels skins: Skin
//! texels u: vec4f
//! texels v: vec4f
//! texels colliders: Colliders
//! texels grips_was: vec4f

// Depth at which the pressure has doubled by its part with the fifth power, in cells.
override FIRM: f32 = 0.5;
// Up to which it begins softly, see `give`.
override SOFT: f32 = 0.06;

// Some obstacle is neither a plane nor a room: their surface is not flat between a point and its faces.
override CURVED: bool = true;

struct Vectors { d: array<vec4f> }
@group(0) @binding(0) var cells: texture_1d<u32>;
@group(0) @binding(1) var solids: texture_1d<u32>;
@group(0) @binding(2) var skins: texture_1d<u32>;
@group(0) @binding(3) var u: texture_1d<u32>;
@group(0) @binding(4) var v: texture_1d<u32>;
@group(0) @binding(5) var colliders: texture_1d<u32>;
// Where each point took hold, in the axes of the obstacle whose number + 1 is in w; 0: it holds none. The same buffer,
// read and then written by its lane.
@group(0) @binding(6) var grips_was: texture_1d<u32>;
@group(0) @binding(7) var<storage, read_write> grips: Vectors;
@group(0) @binding(8) var<storage, read_write> pushes: Vectors;     // four a point: force at the point itself and the
// energy of its contact; force at its face along x, y, z, and by how many cells that is above the point [N, J]
@group(0) @binding(9) var<storage, read_write> clock: Clock;
var<immediate> reference: Reference;

// An obstacle as a face sees it, `off` from its point, which sees it as o.
fn from_face(o: Facing, c: Collider, p: Pose, x: vec3f, off: vec3f, time: f32, side: u32) -> Facing {
    if (CURVED) { return facing(c, p, x + off, time, side); }
    return Facing(o.n, o.gap + dot(off, o.n), o.v);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let dt = clock.dt;
    let time = clock.frame_start + clock.t;
    let count = textureLoad(colliders, 0u, 0).x;
    let i = id.x;
    if (i >= reference.skins) { return; }
    let head = texel(skins, 2u * i);
    let tag = bitcast<u32>(texel(skins, 2u * i + 1u).w);
    let point = bitcast<u32>(head.w);
    let solid = load_solid(solids, tag & BODY_MASK);
    let moved = sum_at(cells, u, point);
    let x = head.xyz + moved.v;
    let speed = sum_at(cells, v, point).v;
    let inv = 1.0 / reference.dx;
    let f = mat3x3f(vec3f(1.0, 0.0, 0.0) + inv * moved.x, vec3f(0.0, 1.0, 0.0) + inv * moved.y,
        vec3f(0.0, 0.0, 1.0) + inv * moved.z);
    let cof = cofactor(f);
    let quarter = 0.25 * reference.dx;
    let face = 4.0 * quarter * quarter;
    let held = texel(grips_was, i);
    var force = vec3f(0.0);
    var faces = mat3x3f();
    var ways = vec3f(0.0);
    var energy = 0.0;
    var grip = vec4f(0.0);
    var firmest = 0.0;
    var rub = vec3f(0.0);
    var rub_at = vec3f(0.0);
    var rub_energy = 0.0;
    var closing = 0.0;
    var deepest = 0.0;
    // Force times the obstacle's velocity [W]: what that brings to motion, deformation and springs together.
    var power = 0.0;
    var rub_speed = vec3f(0.0);
    for (var k = 0u; k < count; k++) {
        let c = load_collider(k);
        let p = pose(c, time);
        for (var side = 0u; side < sides(c); side++) {
            let o = facing(c, p, x, time, side);
            let approach = -dot(speed - o.v, o.n);
            let fast = hurry(approach, solid.wave);
            // What arrives within two steps as long as this one shortens the next, so that it does not begin deep inside;
            // what leaves does so too, for steps that are shorter on one of both ways make energy.
            let rate = abs(approach);
            if (o.gap < quarter + 2.0 * rate * dt) { closing = max(closing, rate + 2.0 * fast); }
            let a = face_against(tag, 0u, cof[0], o.n, face);
            let b = face_against(tag, 1u, cof[1], o.n, face);
            let d = face_against(tag, 2u, cof[2], o.n, face);
            let way = vec3f(a.way, b.way, d.way);
            let at_x = from_face(o, c, p, x, quarter * a.way * f[0] + moved.xx / 32.0, time, side);
            let at_y = from_face(o, c, p, x, quarter * b.way * f[1] + moved.yy / 32.0, time, side);
            let at_z = from_face(o, c, p, x, quarter * d.way * f[2] + moved.zz / 32.0, time, side);
            let deep = -vec3f(at_x.gap, at_y.gap, at_z.gap);
            let areas = vec3f(a.area, b.area, d.area);
            // Faces with a neighbour are inside the body, and press nothing.
            let depth = select(vec3f(0.0), max(deep, vec3f(0.0)), areas > vec3f(0.0));
            let spring = solid.stiffness * rebound(approach, solid.wave) * areas
                * give(depth, SOFT * reference.dx, FIRM * reference.dx);
            // The spring is damped as the body is while they come together, and never pulls.
            let taken = SHOCK * solid.density * fast * fast + solid.stiffness * solid.damping * max(approach, 0.0);
            let press = spring + select(vec3f(0.0), taken * areas, depth > vec3f(0.0));
            let normal = press.x + press.y + press.z;
            let mine = held.w == f32(k + 1u);
            // Where the point took hold has moved with the obstacle.
            let slid = select(vec3f(0.0), x - to_world(p, held.xyz), mine);
            if (c.sticky != 0u) {
                if (normal <= 0.0 && !mine) { continue; }
                force -= solid.stiffness * face * slid;
                power -= solid.stiffness * face * dot(slid, o.v);
                grip = select(vec4f(to_own(p, x), f32(k + 1u)), held, mine);
                energy += 0.5 * solid.stiffness * face * dot(slid, slid);
                rub = vec3f(0.0);
                rub_energy = 0.0;
                firmest = 1e30;
                continue;
            }
            if (normal <= 0.0) { continue; }
            faces += mat3x3f(press.x * at_x.n, press.y * at_y.n, press.z * at_z.n);
            power += dot(press, vec3f(dot(at_x.n, at_x.v), dot(at_y.n, at_y.v), dot(at_z.n, at_z.v)));
            ways = select(ways, 0.25 * way, press > vec3f(0.0));
            energy += solid.stiffness * dot(areas, stored(depth, SOFT * reference.dx, FIRM * reference.dx));
            deepest = max(deepest, max(depth.x, max(depth.y, depth.z)) + rate * dt);
            // It rubs on the one that it is pressed to most.
            if (normal <= firmest) { continue; }
            firmest = normal;
            let along = slid - dot(slid, o.n) * o.n;
            let stiffness = solid.stiffness * (a.area + b.area + d.area);
            let kept = min(1.0, c.friction * normal / max(stiffness * length(along), 1e-30));
            grip = vec4f(to_own(p, x - kept * along), f32(k + 1u));
            rub = (-stiffness * kept) * along;
            rub_at = press / normal;
            rub_speed = o.v;
            rub_energy = 0.5 * stiffness * kept * kept * dot(along, along);
        }
    }
    let to = 4u * i;
    pushes.d[to] = vec4f(force, energy + rub_energy);
    pushes.d[to + 1u] = vec4f(faces[0] + rub_at.x * rub, ways.x);
    pushes.d[to + 2u] = vec4f(faces[1] + rub_at.y * rub, ways.y);
    pushes.d[to + 3u] = vec4f(faces[2] + rub_at.z * rub, ways.z);
    grips.d[i] = grip;
    if (COUNTS_WORK) {
        // Nodes are kicked by half of their last step, which each keeps, and half of this one; once the frame is done, by the
        // former alone.
        let node = textureLoad(cells, 3u * (point >> 3u) + 1u, 0).x + 1u;
        count_units(0.5 * (texel(v, node).w + dt) * (power + dot(rub, rub_speed)));
    }
    // The springs' share of the fastest vibration, half of all at rest, grows by as much as the pressure steepens.
    // That of one step on, for it comes late otherwise.
    let firm = pow(deepest / (FIRM * reference.dx), 4.0);
    let stiff = (sqrt(1.0 + 2.5 * firm) - 1.0) * solid.wave;
    if (closing + stiff > 0.0) { atomicMax(&clock.speed_bits, bitcast<u32>(max(clock.wave_speed, solid.wave) + stiff + closing)); }
}

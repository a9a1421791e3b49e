//! use lib/texel lib/grid lib/clock lib/particle lib/sph_kernel
// What the kernels of SPH share. All particles have the same volume at rest V = h³; the fill
// s = V Σ W is their number density over that at rest (Solenthaler & Pajarola 2008), so bodies of any densities meet.

// Side of a cell of the sort [h]: what is within 2 h, and a skin around that, is in the cells next to one's own.
const CELL: f32 = 2.2;
// Neighbours there is room for; 32 is a regular filling's number.
const NEIGHBOURS: u32 = 64u;

// Sums over a particle's neighbours.
struct Crowd {
    slope: vec3f,       // Σ V ∇W [1/m]
    fill: f32,          // Σ V W, its own included
    coupling: f32,      // Σ |V ∇W|² / ρ [m/kg]
    count: u32,         // neighbours in its list
    spare: vec2u,
}

// What a particle meets besides its neighbours.
struct Local {
    wall: vec3f,        // ∇ of the walls' part of s [1/m]
    drift: f32,         // Σ over walls of their velocity times their part of that [1/s]
    drive: vec3f,       // acceleration by gravity, fields and the weight of what a wall stands for [m/s²]
    fill: f32,          // s, walls included
    slide: vec3f,       // velocity of the walls [m/s]
    friction: f32,      // Coulomb's coefficient
    response: f32,      // by how much a pressure lowers its own particle's rate of s: A, ds = −dt² A P [m/kg]
    drag: f32,          // viscous drag of walls that stick [1/s]
    density: f32,       // at rest [kg/m³]
    tag: u32,
    squeeze: vec3f,     // viscous drag of walls that let slip, along their normals only [1/s]
    power: f32,         // what walls that move give through `drive` [W/kg]
}

// Acceleration of a particle by pressures: Σ (P_i + P_j) V ∇W over its neighbours, and the walls', which mirror its own.
fn press(own: Local, push: vec3f, pressure: f32) -> vec3f {
    return -(push / STEEP + pressure * own.wall) / own.density;
}

// What walls that move give a particle of 1 kg [W]: the force of each, times its velocity. Relative to a wall, what it does takes
// energy or stores it.
fn given(own: Local, pressure: f32) -> f32 {
    return own.power - pressure * own.drift / own.density;
}

// What walls that let slip take of a velocity relative to theirs [m/s²]. Where two meet they act along the mean of
// their normals.
fn squeezed(own: Local, v: vec3f) -> vec3f {
    return own.squeeze * (dot(own.squeeze, v) / max(length(own.squeeze), 1e-20));
}

// What shifts need to know of a particle, by its number.
struct Debt {
    owed: f32,          // what of its s is shifts'
    noted: f32,         // its V Σ W before the last of them; 0 before the first
    head: f32,          // pressure over density [m²/s²]
    spare: f32,
}

// How far from a free surface, 0 at one and 1 within, by the slope of the fill times h: a lattice's outer layer has 0.5.
fn inside_of(slope: f32) -> f32 {
    return 1.0 - smoothstep(0.25, 0.45, slope);
}

// Viscosity between two particles.
fn between(a: f32, b: f32) -> f32 {
    return 2.0 * a * b / max(a + b, 1e-30);
}

fn h_of() -> f32 { return grid.dx / CELL; }

// Mass of a particle [kg].
fn mass_of(own: Local) -> f32 { return own.density * h_of() * h_of() * h_of(); }

// Words of the neighbour lists: four neighbours of each particle in turn.
fn list_at(stride: u32, i: u32, n: u32) -> u32 {
    return ((n >> 2u) * stride + i) * 4u + (n & 3u);
}
fn listed(list: texture_1d<u32>, stride: u32, i: u32, n: u32) -> vec4u {
    return textureLoad(list, (n >> 2u) * stride + i, 0);
}
fn load_crowd(t: texture_1d<u32>, i: u32) -> Crowd {
    let a = texel(t, 2u * i);
    let b = textureLoad(t, 2u * i + 1u, 0);
    return Crowd(a.xyz, a.w, bitcast<f32>(b.x), b.y, vec2u(0u));
}
fn load_local(t: texture_1d<u32>, i: u32) -> Local {
    let a = texel(t, 5u * i);
    let b = texel(t, 5u * i + 1u);
    let c = texel(t, 5u * i + 2u);
    let d = texel(t, 5u * i + 3u);
    let e = texel(t, 5u * i + 4u);
    return Local(a.xyz, a.w, b.xyz, b.w, c.xyz, c.w, d.x, d.y, d.z, bitcast<u32>(d.w), e.xyz, e.w);
}

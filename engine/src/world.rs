//! What is simulated, ready for the solvers: particles, bodies, fields, obstacles, grid. The solvers meet here and
//! never import each other. Knows nothing of files or of Vulkan.

use bytemuck::Zeroable;
use physvideo_gpu::kernels;
use physvideo_gpu::kernels::family::field;

use crate::fluid::{self, CELL, Fluid};
use crate::scene::{Collider, Field, FieldRegion, Material, Object};
use crate::walls::met;

/// Everything a run simulates.
#[derive(Clone, Debug)]
pub struct World {
    /// The bodies, in the order of their tags.
    pub bodies: Vec<Body>,
    /// Gravity [m/s²].
    pub gravity: [f32; 3],
    /// Force fields (at most 16).
    pub fields: Vec<kernels::Field>,
    /// Obstacles (at most 16).
    pub colliders: Vec<kernels::Collider>,
    /// Corners of the space the grid covers [m].
    pub domain: ([f32; 3], [f32; 3]),
    /// Cell size [m].
    pub dx: f32,
    /// Courant number of the elastic limit.
    pub courant: f32,
    /// A fixed substep [s].
    pub force_dt: Option<f32>,
    /// Settings of fluids that SPH simulates.
    pub fluid: Fluid,
}

/// Fields, and obstacles, that fit in one scene.
const MOST: usize = 16;

impl World {
    /// Longest step that the explicit drag of winds and damping stands [s], 0 without: half of what makes the strongest
    /// overshoot.
    pub fn longest_step(&self) -> f32 {
        let rate = |f: &kernels::Field| match f.kind {
            field::WIND => f.p0,
            field::DAMPING => f.a[..3].iter().copied().fold(0.0, f32::max),
            _ => 0.0,
        };
        let drag = self.fields.iter().map(rate).fold(0.0, f32::max);
        if drag > 0.0 { 0.5 / drag } else { 0.0 }
    }

    /// Speeds that limit the step at rest, of the slowest and the fastest body [m/s].
    pub fn wave_speeds(&self) -> (f32, f32) {
        let speeds = self.bodies.iter().map(|b| b.step_speed(self.dx));
        speeds.fold((f32::MAX, 0.0), |(low, high), c| (low.min(c), high.max(c)))
    }

    /// Largest speed of a particle at the start [m/s].
    pub fn start_speed(&self) -> f32 {
        // In f64: squares of what a scene may say overflow f32.
        let square = |v: &[f32; 3]| v.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>();
        let squares = self.bodies.iter().flat_map(|b| &b.velocities).map(square);
        squares.fold(0.0, f64::max).sqrt() as f32
    }

    /// Whether its bodies are fluids of SPH.
    pub fn is_fluid(&self) -> bool {
        self.bodies.iter().any(|b| matches!(b.material, Material::Sph { .. }))
    }

    /// Whether any of them has surface tension.
    pub fn is_tense(&self) -> bool {
        self.bodies.iter().any(|b| b.surface_tension() > 0.0)
    }

    /// Side of the cells that particles are sorted into [m].
    pub fn cell(&self) -> f32 {
        if self.is_fluid() { CELL * self.fluid.particle_size } else { self.dx }
    }

    /// Gravity and fields as the kernels see them.
    pub fn forces(&self) -> kernels::Forces {
        let mut forces = kernels::Forces::zeroed();
        forces.count = self.fields.len().min(MOST) as u32;
        for (slot, field) in forces.d.iter_mut().zip(&self.fields) {
            *slot = *field;
        }
        forces
    }

    /// The obstacles as the kernels see them. A liquid of SPH does not meet those behind a room's walls.
    pub fn obstacles(&self) -> kernels::Colliders {
        // A hundredth of a particle is rounding of what was meant to coincide.
        let met = if self.is_fluid() {
            met(&self.colliders, 1e-2 * self.fluid.particle_size)
        } else {
            self.colliders.clone()
        };
        let mut colliders = kernels::Colliders::zeroed();
        colliders.count = met.len().min(MOST) as u32;
        for (slot, collider) in colliders.d.iter_mut().zip(&met) {
            *slot = *collider;
        }
        colliders
    }

    /// Substep at the start [s].
    pub fn step(&self) -> f32 {
        self.force_dt.unwrap_or_else(|| self.chosen_step())
    }

    /// The same if none is forced [s].
    pub fn chosen_step(&self) -> f32 {
        self.step_at(self.start_speed())
    }

    /// Step that would be chosen while something moves at `speed` [m/s] [s].
    pub fn step_at(&self, speed: f32) -> f32 {
        if self.is_fluid() {
            return fluid::step(self, speed);
        }
        let waves = self.courant * self.dx / (self.wave_speeds().1 + speed);
        let longest = self.longest_step();
        if longest > 0.0 { waves.min(longest) } else { waves }
    }
}

/// A simulated body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its name in the scene.
    pub name: String,
    /// Material.
    pub material: Material,
    /// Density at rest [kg/m³].
    pub density: f32,
    /// Positions at the start [m].
    pub positions: Vec<[f32; 3]>,
    /// Volume of each particle at rest [m³].
    pub particle_volume: f32,
    /// Velocities at the start [m/s], one for each particle.
    pub velocities: Vec<[f32; 3]>,
    /// Particles that are held.
    pub pinned: Vec<bool>,
    /// Gravity that acts on it instead of the world's [m/s²].
    pub gravity: Option<[f32; 3]>,
    /// Starts at rest under gravity: the stress that carries its weight is there from the start and stays as a dead
    /// load, so that only what changes moves it.
    pub prestress: bool,
    /// Coulomb friction of its surface against other bodies, where it is felt; of two the smaller counts.
    pub friction: f32,
    /// Damping time β [s]: stress gains β times its rate.
    pub damping: f32,
    /// Bit i: field i acts on it.
    pub fields: u32,
    /// Where its particles start anew after they have gone.
    pub recycle: Option<kernels::Return>,
    /// When its particles leave the source; absent: all are there from the start.
    pub emission: Option<Emission>,
}

/// How the particles of a body leave its source: whole copies of it one after another, each layer by layer. Particles are
/// in the order in which they leave, and stand where they do.
#[derive(Clone, Debug, PartialEq)]
pub struct Emission {
    /// When the first leaves [s].
    pub start: f64,
    /// None leaves from then on [s].
    pub end: f64,
    /// From one copy to the next [s].
    pub period: f64,
    /// When each particle of a copy leaves after its first [s], ascending.
    pub delays: Vec<f64>,
    /// How long each is there [s]; absent: to the end.
    pub lifetime: Option<f64>,
}

impl Emission {
    /// When particle `number`, counted through all copies, leaves [s].
    pub fn due(&self, number: u64) -> f64 {
        let each = self.delays.len() as u64;
        self.start + (number / each) as f64 * self.period + self.delays[(number % each) as usize]
    }
}

/// Viscosity across a cell, as a speed: the step C dx / (c + 9 η/(ρ dx)) stays at dx² ρ/(12 η) for C = 0.75. A particle
/// nearly alone stands no more: Σ g²/w ≤ 6 an axis makes its own rate 18 · 4/3 η/(ρ dx²), and a step 2 over that.
const VISCOUS: f32 = 9.0;

/// ω dx/(2 c) of the fastest vibration of a body on a grid of its own (`QUICK` in WGSL).
const QUICK: f32 = 1.1;

impl Body {
    /// Its material for the kernels, under the world's gravity [m/s²] unless it has its own, on cells of `dx` [m].
    pub fn constants(&self, gravity: [f32; 3], dx: f32) -> kernels::Body {
        let law = self.material.law();
        // A body whose weight is carried from the start feels no gravity beyond it.
        let gravity = if self.prestress { [0.0; 3] } else { self.gravity.unwrap_or(gravity) };
        let wave = self.step_speed(dx);
        let (material, mu, lambda, p) = (law.material, law.mu, law.lambda, law.own);
        kernels::Body { material, fields: self.fields, mu, lambda, p, gravity, wave }
    }

    /// Its surface tension [N/m].
    pub fn surface_tension(&self) -> f32 {
        if let Material::Sph { surface_tension, .. } = self.material { surface_tension } else { 0.0 }
    }

    /// Speed of the fastest wave at rest, c = sqrt((λ + 2μ)/ρ) [m/s].
    pub fn wave_speed(&self) -> f32 {
        let law = self.material.law();
        ((law.lambda + 2.0 * law.mu) / self.density).sqrt()
    }

    /// By how much damping shortens its steps on cells of `dx` [m] (as `tell_clock` in WGSL has it).
    pub fn damping_cost(&self, dx: f32) -> f32 {
        let z = QUICK * self.damping * self.wave_speed() / dx;
        z + (1.0 + z * z).sqrt()
    }

    /// Speed that limits the step at rest: of waves and of damping, and of viscosity across cells of `dx` [m/s].
    pub fn step_speed(&self, dx: f32) -> f32 {
        self.wave_speed() * self.damping_cost(dx) + VISCOUS * self.material.law().viscosity / (self.density * dx)
    }
}

/// A vector as kernels hold it.
pub fn vec4(v: [f32; 3]) -> [f32; 4] {
    [v[0], v[1], v[2], 0.0]
}

/// A field of the scene as the kernels see it; `seed` and its place among the fields choose its noise.
pub fn field(field: &Field, seed: u64, index: usize) -> kernels::Field {
    let mut out = kernels::Field { start: field.start, end: field.end, ramp: field.ramp, ..Default::default() };
    // Folded to what f32 holds exactly.
    let folded = (seed ^ (seed >> 24) ^ (seed >> 48)) & 0x00ff_ffff;
    field.force.write([folded as f32, index as f32], &mut out);
    if let Some(r) = field.region {
        (out.region, out.region_min, out.region_max) = region(r);
    }
    out
}

/// How the particles of an object start anew as the kernels see it; `seed` and the object's place choose the random
/// places. Absent where the object does not ask for it.
pub fn recycle(object: &Object, seed: u64, index: u32) -> Option<kernels::Return> {
    let recycle = object.recycle?;
    let liquid = matches!(object.material, Some(Material::Liquid { .. }));
    let (region, region_min, region_max) = region(recycle.region);
    let to = recycle.to.unwrap_or_default();
    Some(kernels::Return {
        region,
        region_min,
        region_max,
        solid: if liquid { 0.0 } else { 1.0 },
        stream: (seed as u32) ^ ((seed >> 32) as u32).rotate_left(16) ^ index.rotate_left(24),
        drains: u32::from(recycle.to.is_none()),
        source_min: vec4(to.min),
        source_max: vec4(to.max),
        velocity: vec4(object.velocity),
        gravity: [0.0; 4], // whoever uploads it knows
    })
}

/// A region as the kernels see it: its kind, and two vectors that say where it is.
pub fn region(region: FieldRegion) -> (u32, [f32; 4], [f32; 4]) {
    match region {
        FieldRegion::Box { min, max } => (1, vec4(min), vec4(max)),
        FieldRegion::Ball { center, radius } => (2, vec4(center), [radius, 0.0, 0.0, 0.0]),
    }
}

/// An obstacle of the scene as the kernels see it.
pub fn collider(c: &Collider) -> kernels::Collider {
    let (shape, center, size) = c.shape.constants();
    kernels::Collider {
        shape,
        sticky: u32::from(c.sticky),
        friction: c.friction,
        start: c.start,
        end: c.end,
        center: vec4(center),
        size: vec4(size),
        velocity: vec4(c.velocity),
        spin: vec4(c.angular_velocity),
        ..Default::default()
    }
}

/// The ground plane as an obstacle.
pub fn ground(height: f32, friction: f32) -> kernels::Collider {
    kernels::Collider {
        shape: kernels::family::shape::PLANE,
        friction,
        end: 1e9,
        center: [0.0, 0.0, height, 0.0],
        size: [0.0, 0.0, 1.0, 0.0],
        ..Default::default()
    }
}

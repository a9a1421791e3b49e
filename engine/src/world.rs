//! What is simulated, ready for the solvers: particles, bodies, fields, obstacles, grid. The solvers meet here and
//! never import each other. Knows nothing of files or of Vulkan.

use bytemuck::Zeroable;
use physvideo_gpu::kernels;

use crate::fluid::{self, Fluid};
use crate::scene::{Collider, Field, FieldRegion, Material};

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
    /// Longest step that an explicit drag of the wind stands [s], 0 without wind: half of what makes it overshoot.
    pub fn longest_step(&self) -> f32 {
        let winds = self.fields.iter().filter(|f| f.kind == kernels::family::field::WIND);
        let drag = winds.map(|f| f.p0).fold(0.0, f32::max);
        if drag > 0.0 { 0.5 / drag } else { 0.0 }
    }

    /// Fastest elastic wave of all bodies [m/s].
    pub fn wave_speed(&self) -> f32 {
        self.bodies.iter().map(Body::wave_speed).fold(0.0, f32::max)
    }

    /// Whether its bodies are fluids of SPH.
    pub fn is_fluid(&self) -> bool {
        self.bodies.iter().any(|b| matches!(b.material, Material::Sph { .. }))
    }

    /// Side of the cells that particles are sorted into [m].
    pub fn cell(&self) -> f32 {
        if self.is_fluid() { 2.0 * self.fluid.particle_size } else { self.dx }
    }

    /// Gravity and fields as the kernels see them.
    pub fn forces(&self) -> kernels::Forces {
        let mut forces = kernels::Forces::zeroed();
        forces.gravity[..3].copy_from_slice(&self.gravity);
        forces.count = self.fields.len().min(MOST) as u32;
        for (slot, field) in forces.d.iter_mut().zip(&self.fields) {
            *slot = *field;
        }
        forces
    }

    /// The obstacles as the kernels see them.
    pub fn obstacles(&self) -> kernels::Colliders {
        let mut colliders = kernels::Colliders::zeroed();
        colliders.count = self.colliders.len().min(MOST) as u32;
        for (slot, collider) in colliders.d.iter_mut().zip(&self.colliders) {
            *slot = *collider;
        }
        colliders
    }

    /// Substep at the start, when nothing moves faster than the waves [s].
    pub fn step(&self) -> f32 {
        if self.is_fluid() {
            return self.force_dt.unwrap_or_else(|| fluid::step(self));
        }
        let waves = self.courant * self.dx / self.wave_speed();
        let longest = self.longest_step();
        self.force_dt.unwrap_or(if longest > 0.0 { waves.min(longest) } else { waves })
    }
}

/// Bit of a body's fields: its weight is carried from the start (`CARRIED` in WGSL).
const CARRIED: u32 = 0x8000_0000;

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
    /// Starts at rest under gravity: the stress that carries its weight is there from the start and stays as a dead
    /// load, so that only what changes moves it.
    pub prestress: bool,
    /// Bit i: field i acts on it.
    pub fields: u32,
}

/// Lamé parameters [Pa] from Young's modulus and Poisson's ratio.
pub fn lame(young: f32, poisson: f32) -> (f32, f32) {
    let (e, nu) = (f64::from(young), f64::from(poisson));
    ((e / (2.0 * (1.0 + nu))) as f32, (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))) as f32)
}

impl Body {
    /// Kind, μ and λ of its material for the kernels.
    pub fn constants(&self) -> kernels::Body {
        if let Material::Sph { viscosity } = self.material {
            return kernels::Body { material: 0, fields: self.fields, mu: viscosity, lambda: 0.0 };
        }
        let (material, young, poisson) = self.material.constants();
        let (mu, lambda) = lame(young, poisson);
        kernels::Body { material, fields: self.fields | if self.prestress { CARRIED } else { 0 }, mu, lambda }
    }

    /// Speed of the fastest elastic wave, c = sqrt((λ + 2μ)/ρ) [m/s].
    pub fn wave_speed(&self) -> f32 {
        let b = self.constants();
        ((b.lambda + 2.0 * b.mu) / self.density).sqrt()
    }
}

/// A vector as kernels hold it.
pub fn vec4(v: [f32; 3]) -> [f32; 4] {
    [v[0], v[1], v[2], 0.0]
}

/// A field of the scene as the kernels see it.
pub fn field(field: &Field) -> kernels::Field {
    let mut out = kernels::Field { start: field.start, end: field.end, ramp: field.ramp, ..Default::default() };
    field.force.write(&mut out);
    match field.region {
        None => {}
        Some(FieldRegion::Box { min, max }) => {
            (out.region, out.region_min, out.region_max) = (1, vec4(min), vec4(max));
        }
        Some(FieldRegion::Ball { center, radius }) => {
            (out.region, out.region_min, out.region_max) = (2, vec4(center), [radius, 0.0, 0.0, 0.0]);
        }
    }
    out
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

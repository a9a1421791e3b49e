//! What SPH needs of a world: its particles' size, how pressure is found, and the limits of a step. Knows no device.

use crate::scene::{Material, Pressure, Viscosity};
use crate::world::{Body, World};

/// Settings of the fluids of a world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fluid {
    /// Spacing of the particles, and their smoothing length h [m]; the kernels reach 2 h.
    pub particle_size: f32,
    /// How pressure is found.
    pub pressure: Pressure,
    /// Mean excess of density that ends a density solve of DFSPH (0.01 % by default).
    pub density_error: f32,
    /// The same for the divergence solve: growth of density in a step (0.1 %).
    pub divergence_error: f32,
    /// How viscosity is found; `Auto` solves for it if that makes steps [`PAYS`] times as long.
    pub viscosity: Viscosity,
    /// Particles of WCSPH are shifted to where they are less crowded.
    pub shifting: bool,
}

impl Default for Fluid {
    fn default() -> Self {
        Self {
            particle_size: 0.013,
            pressure: Pressure::default(),
            density_error: 1e-4,
            divergence_error: 1e-3,
            viscosity: Viscosity::default(),
            shifting: false,
        }
    }
}

/// Side of a cell of the sort [h]: neighbours within 2 h, and a skin around that (`CELL` in WGSL).
pub const CELL: f32 = 2.2;

/// Speed of sound of a weakly compressible fluid: sqrt(7 k/ρ) with the paper's k = 5e4 Pa at 1000 kg/m³ [m/s].
pub const SOUND: f32 = 18.708_287;

/// By how much longer steps must be for viscosity to be solved for: a solve of some twenty iterations costs about as much
/// as two explicit steps, and more where the viscosity is higher.
pub const PAYS: f32 = 4.0;

/// What bounds a step: Courant's number over `speed` + the fastest particle, and the longest step whatever they say [s].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Limits {
    /// dt ≤ courant · h / (speed + V).
    pub courant: f32,
    /// [m/s]
    pub speed: f32,
    /// [s]
    pub longest: f32,
    /// Viscosity bounds nothing, because it is solved for.
    pub implicit: bool,
}

/// What a step may be of sqrt(ρ h³/(2π σ)), the time of the shortest capillary wave (Brackbill, Kothe & Zemach 1992).
/// Drops of 5 h stood 0.36.
const CAPILLARY: f32 = 0.25;

/// Longest step that a body's surface tension stands [s]; absent where it has none.
fn capillary(body: &Body, h: f32, scale: f32) -> Option<f32> {
    let tension = body.surface_tension();
    (tension > 0.0).then(|| CAPILLARY * scale * (body.density * h.powi(3) / (std::f32::consts::TAU * tension)).sqrt())
}

/// The limits of Monaghan (1992) and Morris (1997): 0.25 h/(c + V), or without sound 0.4 h/V; 0.125 h²/ν, where 0.15 is
/// what forces along the line of centres stand; 0.125 sqrt(h/g); and that of surface tension. A scene's Courant number
/// scales all but that of viscosity; 0.75, the default, stands for these.
pub fn limits(world: &World) -> Limits {
    let h = world.fluid.particle_size;
    let scale = world.courant / 0.75;
    let gravity = world.gravity.iter().map(|g| g * g).sum::<f32>().sqrt();
    let (courant, speed) = match world.fluid.pressure {
        Pressure::Wcsph => (0.25 * scale, SOUND),
        Pressure::Dfsph => (0.4 * scale, 0.0),
    };
    let falls = if gravity > 0.0 { 0.125 * scale * (h / gravity).sqrt() } else { f32::MAX };
    let tense = world.bodies.iter().filter_map(|b| capillary(b, h, scale)).fold(f32::MAX, f32::min);
    let falls = falls.min(tense);
    let wind = world.longest_step();
    let longest = if wind > 0.0 { falls.min(wind) } else { falls };
    let viscous = viscous_step(world);
    let others = longest.min(courant * h / (speed + world.start_speed()));
    let pays = match world.fluid.viscosity {
        Viscosity::Auto => viscous * PAYS < others,
        Viscosity::Explicit => false,
        Viscosity::Implicit => true,
    };
    let implicit = viscous < f32::MAX && pays;
    Limits { courant, speed, longest: if implicit { longest } else { longest.min(viscous) }, implicit }
}

/// Longest step that explicit viscosity stands [s].
fn viscous_step(world: &World) -> f32 {
    let h = world.fluid.particle_size;
    let thickest = world.bodies.iter().map(|b| match b.material {
        Material::Sph { viscosity, .. } => viscosity,
        _ => 0.0,
    });
    let thickest = thickest.fold(0.0, f32::max);
    if thickest > 0.0 { 0.125 * h * h / thickest } else { f32::MAX }
}

/// How viscosity is found and why, where it matters to the step.
fn viscosity_note(world: &World) -> Option<String> {
    let (viscous, taken) = (viscous_step(world), step(world, world.start_speed()));
    if limits(world).implicit {
        let times = taken / viscous;
        return Some(match times > 1.0 {
            true => {
                format!("viscosity is solved for: without it steps would be {viscous:.1e} s, {times:.1} times as short")
            }
            false => "viscosity is solved for, as asked: steps would be no shorter without".into(),
        });
    }
    (viscous <= taken).then(|| format!("viscosity shortens steps to {viscous:.1e} s"))
}

/// Step while something moves at `speed` [m/s] [s].
pub fn step(world: &World, speed: f32) -> f32 {
    let l = limits(world);
    l.longest.min(l.courant * world.fluid.particle_size / (l.speed + speed))
}

/// What a user should know of the steps: how viscosity is found, and whose surface tension makes them so short.
pub fn step_notes(world: &World) -> Vec<String> {
    let (step, scale) = (step(world, world.start_speed()), world.courant / 0.75);
    let limit = |b: &Body| capillary(b, world.fluid.particle_size, scale).filter(|limit| *limit <= step);
    let note = |b: &Body| Some(format!("surface tension of '{}' allows steps of {:.1e} s", b.name, limit(b)?));
    viscosity_note(world).into_iter().chain(world.bodies.iter().filter_map(note)).collect()
}

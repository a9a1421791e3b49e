//! The stiffness cap: elastic bodies are made no stiffer than it takes to deform little, so that steps are longer. Speeds
//! and loads are bounds from the scene, never too low for what is described here. Knows no solver.
//!
//! E_eff = min(E, s² max(ρ v²/ε², p/ε)): an impact at v strains a body of wave speed sqrt(E/ρ) by v sqrt(ρ/E), and the
//! pressure p of the weights and forces it carries by p/E. Held bodies bend, by about the square of their slenderness s
//! more than they are pressed (a cantilever of length L and thickness h sags by 1.5 p L²/(E h²) of L); others have s = 1.
//! Sand, snow, foam and plastic bodies yield by their stiffness, and liquids are not elastic: they stay as they are.

use glam::Vec3;
use physvideo_gpu::kernels;
use physvideo_gpu::kernels::family::{field, shape};

use crate::accuracy;
use crate::scene::Material;
use crate::world::{Body, World};

/// A body that was made softer.
#[derive(Clone, Debug, PartialEq)]
pub struct Capped {
    /// Its name.
    pub body: String,
    /// Young's modulus of the scene [Pa].
    pub young: f32,
    /// Young's modulus it is simulated with [Pa].
    pub effective: f32,
}

impl Capped {
    /// E/E_eff.
    pub fn factor(&self) -> f32 {
        self.young / self.effective
    }

    /// What it means, in words.
    pub fn line(&self) -> String {
        format!(
            "'{}' is simulated with `young` {:.3e} Pa instead of {:.3e} Pa, {:.3e} times as soft, by \
             simulation.stiffness_cap: its steps are up to {times:.1} times as long, and its vibration and contact last \
             {times:.1} times as long as they should",
            self.body,
            self.effective,
            self.young,
            self.factor(),
            times = self.factor().sqrt()
        )
    }
}

/// Makes the elastic bodies of `world` no stiffer than a deformation of about `share` needs; says which are softer now.
pub fn apply(share: f32, world: &mut World) -> Vec<Capped> {
    let expected = Expected::of(world);
    let mut capped = Vec::new();
    for body in &mut world.bodies {
        let needed = expected.modulus(body, share);
        if let (Some(effective), Some(young)) = (needed, body.material.young())
            && effective < young
        {
            capped.push(Capped { body: body.name.clone(), young, effective });
            body.material = body.material.with_young(effective);
        }
    }
    capped
}

/// What bodies of a world have to stand.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expected {
    /// The largest speed at which anything meets anything [m/s].
    speed: f64,
    /// Density of the densest body [kg/m³]: the dense may fall on the light.
    density: f64,
    /// Pressure of all bodies' weights and forces [Pa], as if all stood on one another.
    pressure: f64,
}

impl Expected {
    /// v = sqrt(v0² + v_fall² + 2 a D) + v_obstacle + v_wind, each the largest there is: speeds at the start and of
    /// emission, falls to the floor, fields of acceleration a over the domain's diagonal D, obstacles at their rim, winds in
    /// their gusts.
    pub(crate) fn of(world: &World) -> Self {
        let diagonal = length(&[0, 1, 2].map(|a| world.domain.1[a] - world.domain.0[a]));
        let fall = world.bodies.iter().map(|b| fall(b, world)).fold(0.0, f64::max);
        let start = f64::from(world.start_speed());
        let push: f64 = world.fields.iter().map(|f| push(f, world)).sum();
        let gale: f64 = world.fields.iter().map(wind).sum();
        let obstacle = world.colliders.iter().map(|c| rim(c, diagonal)).fold(0.0, f64::max);
        // Drag cannot make anything faster than its wind, but presses while it does not move.
        let drag: f64 = world.fields.iter().map(|f| wind_drag(f) * wind(f)).sum();
        let weight = |b: &Body| {
            let pull = if b.prestress { 0.0 } else { length(&b.gravity.unwrap_or(world.gravity)) };
            let (high, long) = extents(b, &b.gravity.unwrap_or(world.gravity));
            f64::from(b.density) * (pull * if held(b) { long } else { high } + (push + drag) * long)
        };
        Self {
            speed: (start * start + fall + 2.0 * push * diagonal).sqrt() + obstacle + gale,
            density: world.bodies.iter().map(|b| f64::from(b.density)).fold(0.0, f64::max),
            pressure: world.bodies.iter().map(weight).sum(),
        }
    }

    /// The largest speed at which anything meets anything [m/s].
    pub(crate) fn speed(&self) -> f64 {
        self.speed
    }

    /// Young's modulus with which `body` deforms by about `share` [Pa]. None where nothing loads it, and for what is not
    /// elastic.
    pub(crate) fn modulus(&self, body: &Body, share: f32) -> Option<f32> {
        if !body.material.elastic() || body.positions.is_empty() {
            return None;
        }
        let slender = if held(body) {
            let thick = f64::from(accuracy::size(&body.positions, body.particle_volume.cbrt()));
            (extents(body, &[0.0; 3]).1 / thick).max(1.0)
        } else {
            1.0
        };
        let share = f64::from(share);
        let impact = self.density * (self.speed / share).powi(2);
        let needed = (slender * slender * impact.max(self.pressure / share)) as f32;
        (needed > 0.0 && needed.is_finite()).then_some(needed)
    }
}

fn length(v: &[f32]) -> f64 {
    v.iter().map(|c| f64::from(*c).powi(2)).sum::<f64>().sqrt()
}

fn held(body: &Body) -> bool {
    body.pinned.contains(&true)
}

/// Least and greatest place of a body's particles along a direction [m].
fn span(body: &Body, along: Vec3) -> (f32, f32) {
    let places = body.positions.iter().map(|x| along.dot(Vec3::from(*x)));
    places.fold((f32::MAX, f32::MIN), |(low, high), x| (low.min(x), high.max(x)))
}

/// A body's height along gravity, and its longest extent along an axis [m].
fn extents(body: &Body, gravity: &[f32; 3]) -> (f64, f64) {
    if body.positions.is_empty() {
        return (0.0, 0.0);
    }
    let spacing = body.particle_volume.cbrt();
    let side = |along: Vec3| {
        let (low, high) = span(body, along);
        f64::from(high - low + spacing)
    };
    let long = Vec3::AXES.map(side).into_iter().fold(0.0, f64::max);
    match Vec3::from(*gravity).try_normalize() {
        Some(down) => (side(down), long),
        None => (long, long),
    }
}

/// Largest speed of the front of a liquid that spreads under its weight [m/s]: 2 √(g H), H its height (Ritter 1892).
pub(crate) fn front(world: &World) -> f64 {
    let liquid = |b: &&Body| matches!(b.material, Material::Sph { .. } | Material::Liquid { .. });
    let speed = |b: &Body| {
        let gravity = b.gravity.unwrap_or(world.gravity);
        2.0 * (length(&gravity) * extents(b, &gravity).0).sqrt()
    };
    world.bodies.iter().filter(liquid).map(speed).fold(0.0, f64::max)
}

/// Square of the speed that gravity gives a body [m²/s²]: of its fall from where it starts to the highest standing plane
/// below all of it, or through the domain; where it is held, of swinging by its own length.
fn fall(body: &Body, world: &World) -> f64 {
    let gravity = body.gravity.unwrap_or(world.gravity);
    let pull = length(&gravity);
    if pull == 0.0 || body.positions.is_empty() || (held(body) && body.prestress) {
        return 0.0;
    }
    if held(body) {
        return 2.0 * pull * extents(body, &gravity).1;
    }
    let up = -Vec3::from(gravity).normalize_or_zero();
    let lowest = span(body, up).0;
    let (low, high) = (Vec3::from(world.domain.0), Vec3::from(world.domain.1));
    let bottom = up.dot(Vec3::select(up.cmpge(Vec3::ZERO), low, high));
    let at = |v: &[f32; 4]| up.dot(Vec3::new(v[0], v[1], v[2]));
    let stands = |c: &&kernels::Collider| {
        let level = at(&c.size) > 0.999 * length(&c.size[..3]) as f32;
        let still = length(&c.velocity[..3]) + length(&c.spin[..3]) == 0.0;
        c.shape == shape::PLANE && level && still && c.start <= 0.0 && c.end >= 1e9
    };
    // Half a particle may lie in what it rests on.
    let below = world.colliders.iter().filter(stands).map(|c| at(&c.center)).filter(|z| *z <= lowest + world.dx);
    2.0 * pull * f64::from((lowest - below.fold(bottom, f32::max)).max(0.0))
}

/// Largest acceleration of a field that pushes whatever the speed [m/s²].
pub(crate) fn push(f: &kernels::Field, world: &World) -> f64 {
    let (a, strength) = (length(&f.a[..3]), f64::from(f.p0));
    match f.kind {
        field::POINT | field::UNIFORM => a,
        field::VORTEX => strength.abs(),
        // Four standard deviations, at the lowest or the highest point of the domain.
        field::NOISE => {
            let at = |z: f32| strength + f64::from(f.p1) * f64::from(z - f.p2);
            4.0 * a * at(world.domain.0[2]).max(at(world.domain.1[2])).max(0.0)
        }
        _ => 0.0,
    }
}

/// Largest speed of a wind [m/s].
pub(crate) fn wind(f: &kernels::Field) -> f64 {
    if f.kind == field::WIND { length(&f.a[..3]) * (1.0 + f64::from(f.p1)) } else { 0.0 }
}

/// Drag rate of a wind [1/s].
pub(crate) fn wind_drag(f: &kernels::Field) -> f64 {
    if f.kind == field::WIND { f64::from(f.p0) } else { 0.0 }
}

/// Largest speed of an obstacle's surface [m/s]; a plane turns as far as the domain reaches.
fn rim(c: &kernels::Collider, diagonal: f64) -> f64 {
    let reach = if c.shape == shape::PLANE { diagonal } else { length(&c.size[..3]) };
    length(&c.velocity[..3]) + length(&c.spin[..3]) * reach
}

#[cfg(test)]
#[path = "cap_tests.rs"]
mod tests;

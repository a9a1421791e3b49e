//! A block comes down on a floor, planar, and bounces (on a grid of its own as deep as wide, with nothing beside it), or
//! beside a wall and slumps or flows away: the path of its centre of mass against that of the same block on a finer grid. Nothing of it is known in closed form; what is measured is how
//! far a grid and a step are from the limit that the method itself goes to, not how far that limit is from nature.

use physvideo::accuracy::Kind;
use physvideo::fluid::Fluid;
use physvideo::scene::{Material, Pressure};
use physvideo::world::{World, ground};
use physvideo_gpu::Gpu;

use super::deposit::Pool;
use super::setup::{Lattice, Play, world};
use crate::liquid;

const GRAVITY: f64 = 9.81;
/// Instants at which paths are compared, half a time of fall from one to the next.
const INSTANTS: u32 = 5;

/// A block and the floor it meets.
#[derive(Clone, Copy, Debug)]
pub struct Block {
    /// What it is made of.
    pub material: Material,
    /// How a liquid of SPH finds its pressure.
    pub pressure: Pressure,
    /// [kg/m³]
    pub density: f64,
    /// Width from the wall [m].
    pub wide: f64,
    /// [m]
    pub high: f64,
    /// As if it had fallen so far before it touches the floor [m].
    pub fallen: f64,
    /// Of the floor.
    pub friction: f32,
    /// On a grid of its own.
    pub own: bool,
    /// There [s].
    pub damping: f32,
}

impl Block {
    /// The blocks that the table of a kind of body is measured with.
    pub fn measured(kind: Kind) -> [Self; 2] {
        [Self::tall(kind), Self::broad(kind)]
    }

    /// Twice as high as wide, fallen from its own height; elastic ones, which would buckle, as high as wide.
    fn tall(kind: Kind) -> Self {
        let (young, poisson) = (1.8e4, 0.3);
        let (mut pressure, mut density, mut friction) = (Pressure::Dfsph, 1000.0, 0.4);
        let material = match kind {
            Kind::Held | Kind::Free | Kind::FreeOwn => Material::Elastic { young, poisson },
            Kind::Plastic => Material::Plastic { young, poisson, yield_stress: 1.5e3, hardening: 0.0 },
            Kind::Snow => {
                density = 400.0;
                Material::Snow {
                    young: 5e4,
                    poisson: 0.2,
                    critical_compression: 0.025,
                    critical_stretch: 0.0075,
                    hardening: 10.0,
                }
            }
            Kind::Foam => Material::Foam { young, poisson },
            Kind::Sand => {
                (density, friction) = (1600.0, 0.45);
                Material::Sand { young: 2e5, poisson: 0.3, friction: 0.45 }
            }
            Kind::Liquid => {
                friction = 0.0;
                Material::Liquid { bulk: 2e5, exponent: 7.0, viscosity: 0.0 }
            }
            Kind::Dfsph | Kind::Wcsph => {
                friction = 0.0;
                if kind == Kind::Wcsph {
                    pressure = Pressure::Wcsph;
                }
                Material::Sph { viscosity: 1e-4, surface_tension: 0.0 }
            }
        };
        let (high, fallen) = if material.elastic() { (0.1, 0.3) } else { (0.2, 0.2) };
        let own = kind == Kind::FreeOwn;
        Self { material, pressure, density, wide: 0.1, high, fallen, friction, own, damping: 0.0 }
    }

    /// A broader one, of another stiffness and friction and less of a fall.
    fn broad(kind: Kind) -> Self {
        let tall = Self::tall(kind);
        let material = match tall.material {
            Material::Elastic { .. } => Material::NeoHookean { young: 5e4, poisson: 0.4 },
            Material::Plastic { .. } => {
                Material::Plastic { young: 8e4, poisson: 0.2, yield_stress: 3e3, hardening: 1e3 }
            }
            Material::Sand { .. } => Material::Sand { young: 4e5, poisson: 0.2, friction: 0.6 },
            Material::Liquid { .. } => Material::Liquid { bulk: 3e5, exponent: 4.0, viscosity: 0.5 },
            Material::Sph { .. } => Material::Sph { viscosity: 1e-3, surface_tension: 0.0 },
            other => other,
        };
        let friction = if tall.friction > 0.0 { 0.6 } else { 0.0 };
        let (high, fallen) = match (tall.material.elastic(), tall.own) {
            // Whole layers of half a cell at any even number of them.
            (true, true) => (0.225, 0.2),
            (true, false) => (0.25, 0.2),
            _ => (0.2, 0.1),
        };
        Self { material, wide: 0.15, high, fallen, friction, density: 0.9 * tall.density, ..tall }
    }

    /// One that no table was measured with.
    pub fn unseen(kind: Kind) -> Self {
        let tall = Self::tall(kind);
        let material = match tall.material {
            Material::Elastic { .. } => Material::Elastic { young: 3e4, poisson: 0.2 },
            Material::Plastic { .. } => {
                Material::Plastic { young: 6e4, poisson: 0.35, yield_stress: 2e3, hardening: 0.0 }
            }
            Material::Sand { .. } => Material::Sand { young: 3e5, poisson: 0.25, friction: 0.5 },
            Material::Liquid { .. } => Material::Liquid { bulk: 2.5e5, exponent: 7.0, viscosity: 0.1 },
            Material::Sph { .. } => Material::Sph { viscosity: 5e-4, surface_tension: 0.0 },
            other => other,
        };
        let friction = if tall.friction > 0.0 { 0.5 } else { 0.0 };
        let (high, fallen) = if tall.material.elastic() { (0.18, 0.3) } else { (0.14, 0.15) };
        Self { material, wide: 0.12, high, fallen, friction, density: 1.1 * tall.density, ..tall }
    }

    /// Its world without floor and walls and as deep as wide, at four cells along its width: to see how thick it is.
    pub fn solid(&self) -> World {
        let mut w = self.world(4, 0.75);
        let spacing = w.bodies[0].particle_volume.cbrt().min(0.125 * self.wide as f32);
        let spacing = if w.is_fluid() { w.fluid.particle_size } else { spacing };
        let counts = [self.wide, self.wide, self.high].map(|c| (c / f64::from(spacing)).round() as usize);
        let places = super::setup::divide([0.0; 3], [self.wide, self.wide, self.high], counts);
        w.bodies[0].positions = places.iter().map(|x| x.map(|c| c as f32)).collect();
        w.bodies[0].particle_volume = spacing.powi(3);
        w
    }

    /// Its world with `cells` cells, or particles of SPH, along its width.
    pub fn world(&self, cells: u32, courant: f32) -> World {
        let dx = self.wide / f64::from(cells);
        // A liquid's front runs two times sqrt(gH).
        let room = 2.5 * self.wide.max(self.high) * f64::from(INSTANTS);
        let mut w = if self.own {
            self.alone(dx)
        } else if matches!(self.material, Material::Sph { .. }) {
            let depth = 4.0 * dx;
            let places = liquid::lattice(dx, [0.0; 3], [self.wide, depth, self.high]);
            let Material::Sph { viscosity, .. } = self.material else { unreachable!() };
            let body = liquid::liquid(self.density as f32, viscosity, dx, places);
            let mut w = liquid::world(self.pressure, dx, vec![body], [-0.02; 3], [room, depth + 0.02, 4.0 * self.high]);
            w.fluid = Fluid { particle_size: dx as f32, pressure: self.pressure, ..Default::default() };
            w.colliders = vec![liquid::room([0.0; 3], [room - 0.02, depth, 4.0 * self.high])];
            w
        } else {
            let size = [self.wide, self.high];
            let mut w = Pool::new(Lattice::of_eight(dx), self.material, self.density, size, false, room).world;
            // Room for a block that bounces.
            w.domain.1[2] = (3.0 * self.high) as f32;
            w.colliders[0] = ground(0.0, self.friction);
            if self.material.elastic() {
                // It spreads to both sides as it strikes.
                w.colliders.remove(1);
                w.domain.0[0] = -self.wide as f32;
            }
            w
        };
        w.courant = courant;
        w.gravity = [0.0, 0.0, -GRAVITY as f32];
        let speed = (2.0 * GRAVITY * self.fallen).sqrt() as f32;
        w.bodies[0].velocities.fill([0.0, 0.0, -speed]);
        w
    }

    /// It on a lattice of half of `dx`, with nothing but the floor.
    fn alone(&self, dx: f64) -> World {
        let lattice = Lattice::of_eight(dx);
        let places = lattice.fill([0.0; 3], [self.wide, self.wide, self.high], |_| true);
        let mut body = lattice.body(self.material, self.density, &places, |_| [0.0; 3]);
        body.damping = self.damping;
        let (low, high) = ([-self.wide, -self.wide, -dx], [2.0 * self.wide, 2.0 * self.wide, 3.0 * self.high]);
        let mut w = world(vec![body], dx, low, high);
        w.colliders = vec![ground(0.0, self.friction)];
        w
    }

    /// The error of a run of `cells` cells by its path and that of one of `finer`, over the longest way, but no less than its
    /// width. Of what bounces the way it fell counts too: how high it comes is a share of that.
    pub fn error(&self, path: &[[f64; 2]], cells: u32, reference: &[[f64; 2]], finer: u32) -> f64 {
        let (distance, way) = apart(path, reference);
        let scale = if self.material.elastic() { way + self.fallen } else { way.max(self.wide) };
        to_the_limit(distance / scale, cells, finer)
    }

    /// Its centre of mass at the start and at each instant: along the floor and up [m]; and the seconds of wall it took.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn path(&self, gpu: &Gpu, cells: u32, courant: f32) -> Result<(Vec<[f64; 2]>, f64), String> {
        let method = match (self.material, self.pressure) {
            (Material::Sph { .. }, Pressure::Dfsph) => "dfsph",
            (Material::Sph { .. }, Pressure::Wcsph) => "wcsph",
            _ if self.own => "total_lagrangian",
            _ => "updated_lagrangian",
        };
        let mut play = Play::new(gpu, &self.world(cells, courant), method)?;
        let center = |play: &Play| play.center().map(|c| [c[0], c[2]]);
        let mut path = vec![center(&play)?];
        for _ in 0..INSTANTS {
            play.frame(0.5 * (2.0 * self.high / GRAVITY).sqrt())?;
            path.push(center(&play)?);
        }
        Ok((path, play.finish(0.0).wall_s))
    }
}

/// Largest distance of a path from another, and the longest way of the other from its start [m]. Each starts where its own
/// lattice has its centre.
pub fn apart(path: &[[f64; 2]], reference: &[[f64; 2]]) -> (f64, f64) {
    let way = |path: &[[f64; 2]], i: usize| [path[i][0] - path[0][0], path[i][1] - path[0][1]];
    let longest = (0..reference.len()).map(|i| way(reference, i)).map(|w| w[0].hypot(w[1])).fold(0.0, f64::max);
    let off = |i: usize| {
        let (a, b) = (way(path, i), way(reference, i));
        (a[0] - b[0]).hypot(a[1] - b[1])
    };
    ((0..path.len()).map(off).fold(0.0, f64::max), longest)
}

/// The error of a run of `cells` cells by its distance from one of `finer`, if errors shrink as 1/cells: the finer one
/// still has cells/finer of it.
pub fn to_the_limit(distance: f64, cells: u32, finer: u32) -> f64 {
    distance / (1.0 - f64::from(cells) / f64::from(finer))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_order_error_is_found_from_two_runs() {
        // Errors of 0.6 / cells.
        assert!((to_the_limit(0.6 / 6.0 - 0.6 / 24.0, 6, 24) - 0.1).abs() < 1e-12);
    }

    #[test]
    fn paths_are_compared_by_the_way_they_went() {
        let reference = [[0.0, 0.0], [0.0, -1.0], [2.0, 0.0]];
        let path = [[1.0, 1.0], [1.0, 0.1], [3.0, 1.0]];
        let (distance, way) = apart(&path, &reference);
        assert!((distance - 0.1).abs() < 1e-12 && (way - 2.0).abs() < 1e-12);
        assert!(apart(&reference, &reference).0.abs() < 1e-12);
    }
}

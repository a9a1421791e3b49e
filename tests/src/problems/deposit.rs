//! A planar pool of what flows: filled between a floor, a wall at x = 0 and two planes two cells apart, and the shape it
//! takes: height in strips, how far it reaches. Knows no material.

use physvideo::scene::Material;
use physvideo::world::{World, ground};
use physvideo_gpu::kernels::Particle;

use super::setup::{BEHIND, Lattice, divide, plane, world};

/// A block that leans on the wall at x = 0, or on two.
#[derive(Clone, Debug)]
pub struct Pool {
    /// It alone; the domain reaches as far as asked.
    pub world: World,
    /// Where particles are at the start [m].
    pub places: Vec<[f64; 3]>,
    /// Volume of each [m³].
    pub volume: f64,
    /// Of the slab [m].
    pub thick: f64,
    /// Distance of layers [m].
    pub layer: f64,
    /// Where floor and walls act: this far outside the planes [m].
    pub behind: f64,
}

impl Pool {
    /// A block from the wall to `wide`, `high` over the floor [m], whole numbers of cells; `closed`: there is a wall at
    /// `wide` too. Otherwise there is room up to `room` [m].
    pub fn new(lattice: Lattice, material: Material, density: f64, size: [f64; 2], closed: bool, room: f64) -> Self {
        let dx = lattice.dx;
        let behind = BEHIND * dx;
        let [wide, high] = size;
        let end = if closed { wide + behind } else { wide - behind };
        // Five layers of particles, or eight, in the slab's 2.6 cells.
        let across = (2.6 * f64::from(lattice.per_axis)).round() as usize;
        let layers = |length: f64| (length / lattice.spacing()).round() as usize;
        let (low, top) = ([-behind, -behind, -behind], [end, 2.0 * dx + behind, high - behind]);
        let counts = [layers(end + behind), across, layers(high)];
        let places = divide(low, top, counts);
        let volume = (0..3).map(|a| (top[a] - low[a]) / counts[a] as f64).product::<f64>();
        let mut body = lattice.body(material, density, &places, |_| [0.0; 3]);
        body.particle_volume = volume as f32;
        let mut world = world(vec![body], dx, [-dx, -dx, -dx], [room, 3.0 * dx, high + 2.0 * dx]);
        world.colliders = vec![
            ground(0.0, 0.0),
            plane([0.0; 3], [1.0, 0.0, 0.0], false),
            plane([0.0; 3], [0.0, 1.0, 0.0], false),
            plane([0.0, 2.0 * dx, 0.0], [0.0, -1.0, 0.0], false),
        ];
        if closed {
            world.colliders.push(plane([wide, 0.0, 0.0], [-1.0, 0.0, 0.0], false));
        }
        Self { world, places, volume, thick: 2.0 * dx + 2.0 * behind, layer: high / counts[2] as f64, behind }
    }

    /// Its shape.
    pub fn profile(&self, particles: &[Particle]) -> Profile {
        let strip = f64::from(self.world.dx);
        let mut heights = vec![0.0; 1];
        for p in particles {
            let at = ((f64::from(p.x[0]) + self.behind) / strip).max(0.0) as usize;
            if heights.len() <= at {
                heights.resize(at + 1, 0.0);
            }
            heights[at] += self.volume / (strip * self.thick);
        }
        Profile { strip, heights }
    }
}

/// Heights in strips along x, from the wall.
#[derive(Clone, Debug)]
pub struct Profile {
    strip: f64,
    heights: Vec<f64>,
}

impl Profile {
    /// Where it ends: the first strip that is less than `least` high, crossed by a line [m].
    pub fn front(&self, least: f64) -> f64 {
        let Some(first) = self.heights.iter().position(|h| *h < least) else {
            return self.strip * self.heights.len() as f64;
        };
        let (low, high) = (self.heights[first], if first > 0 { self.heights[first - 1] } else { least });
        // Heights are those at the middles of strips.
        let share = (high - least) / (high - low).max(f64::MIN_POSITIVE);
        self.strip * (first as f64 - 0.5 + share.clamp(0.0, 1.0))
    }

    /// Largest height [m].
    pub fn top(&self) -> f64 {
        self.heights.iter().copied().fold(0.0, f64::max)
    }
}

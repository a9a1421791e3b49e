//! Worlds of the problems: particles on a lattice, planes, a solver by the name of a method, and a play that counts what
//! a run takes. Knows no problem.

use std::time::{Duration, Instant};

use physvideo::scene::Material;
use physvideo::stages::lagrangian::Lagrangian;
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::stages::solver::{FrameStats, Measure, Solver};
use physvideo::stages::sph::Sph;
use physvideo::world::{Body, World};
use physvideo_gpu::kernels::{Collider, Deformation, Particle};
use physvideo_gpu::{Gpu, GpuError};

use super::Outcome;

/// Particles on a regular lattice in the cells of a grid.
#[derive(Clone, Copy, Debug)]
pub struct Lattice {
    /// Cell size [m].
    pub dx: f64,
    /// Particles a cell and direction.
    pub per_axis: u32,
}

impl Lattice {
    /// Two a direction, eight a cell.
    pub fn of_eight(dx: f64) -> Self {
        Self { dx, per_axis: 2 }
    }

    /// What a method fills: a name that ends in `_27` has three particles a direction, the others two.
    pub fn of(method: &str, dx: f64) -> Self {
        Self { dx, per_axis: if method.ends_with("_27") { 3 } else { 2 } }
    }

    /// Distance of neighbours [m].
    pub fn spacing(&self) -> f64 {
        self.dx / f64::from(self.per_axis)
    }

    /// Centres of the lattice's cubes in the box [low, high) that `keep` keeps, x fastest [m].
    pub fn fill(&self, low: [f64; 3], high: [f64; 3], keep: impl Fn([f64; 3]) -> bool) -> Vec<[f64; 3]> {
        let counts = std::array::from_fn(|a| ((high[a] - low[a]) / self.spacing()).round() as usize);
        let high = std::array::from_fn(|a| low[a] + counts[a] as f64 * self.spacing());
        divide(low, high, counts).into_iter().filter(|x| keep(*x)).collect()
    }

    /// A body of such particles, all fields acting on it.
    pub fn body(
        &self,
        material: Material,
        density: f64,
        positions: &[[f64; 3]],
        velocity: impl Fn([f64; 3]) -> [f64; 3],
    ) -> Body {
        let single = |x: [f64; 3]| x.map(|c| c as f32);
        Body {
            name: "body".into(),
            material,
            density: density as f32,
            velocities: positions.iter().map(|x| single(velocity(*x))).collect(),
            pinned: vec![],
            prestress: false,
            friction: 0.2,
            particle_volume: self.spacing().powi(3) as f32,
            fields: u32::MAX >> 1,
            gravity: None,
            recycle: None,
            emission: None,
            damping: 0.0,
            positions: positions.iter().map(|x| single(*x)).collect(),
        }
    }
}

/// Centres of the parts of the box [low, high) divided into `counts` along the axes, x fastest [m].
pub fn divide(low: [f64; 3], high: [f64; 3], counts: [usize; 3]) -> Vec<[f64; 3]> {
    let mut out = Vec::new();
    for k in 0..counts[2] {
        for j in 0..counts[1] {
            for i in 0..counts[0] {
                let at = [i, j, k];
                let x = |a: usize| low[a] + (at[a] as f64 + 0.5) * (high[a] - low[a]) / counts[a] as f64;
                out.push([x(0), x(1), x(2)]);
            }
        }
    }
    out
}

/// Cells by which material comes to rest behind the last nodes that a plane holds: it is filled in up to there, so that
/// nothing has to flow into a gap first.
pub const BEHIND: f64 = 0.3;

/// A world without gravity, fields or obstacles over the box [low, high].
pub fn world(bodies: Vec<Body>, dx: f64, low: [f64; 3], high: [f64; 3]) -> World {
    World {
        bodies,
        gravity: [0.0; 3],
        fields: vec![],
        colliders: vec![],
        domain: (low.map(|c| c as f32), high.map(|c| c as f32)),
        dx: dx as f32,
        courant: 0.75,
        force_dt: None,
        fluid: Default::default(),
    }
}

/// A frictionless or sticking half space.
pub fn plane(point: [f64; 3], normal: [f32; 3], sticky: bool) -> Collider {
    Collider {
        shape: 1,
        sticky: u32::from(sticky),
        end: 1e9,
        center: [point[0] as f32, point[1] as f32, point[2] as f32, 0.0],
        size: [normal[0], normal[1], normal[2], 0.0],
        ..Default::default()
    }
}

/// Two frictionless planes that hold a slab of `cells` cells from z = 0 in plane strain.
pub fn between(dx: f64, cells: f64) -> [Collider; 2] {
    [plane([0.0; 3], [0.0, 0.0, 1.0], false), plane([0.0, 0.0, cells * dx], [0.0, 0.0, -1.0], false)]
}

/// What a device says, in words.
pub fn say(error: GpuError) -> String {
    error.to_string()
}

/// The solver of a method. What follows a name's last `_27` is the filling, not the solver.
///
/// # Errors
/// The device's refusal, or that nobody solves so.
pub fn solver<'g>(gpu: &'g Gpu, world: &World, method: &str) -> Result<Box<dyn Solver + 'g>, String> {
    let mpm = |true_gradient| {
        Mpm::new(gpu, world, Method { true_gradient, ..Default::default() })
            .map(|mpm| Box::new(mpm) as Box<dyn Solver + 'g>)
            .map_err(say)
    };
    match method.trim_end_matches("_27") {
        "updated_lagrangian" => mpm(true),
        "mls" => mpm(false),
        "total_lagrangian" => {
            Lagrangian::new(gpu, world).map(|own| Box::new(own) as Box<dyn Solver + 'g>).map_err(|e| e.to_string())
        }
        "wcsph" | "dfsph" => Sph::new(gpu, world).map(|sph| Box::new(sph) as Box<dyn Solver + 'g>).map_err(say),
        other => Err(format!("there is no method '{other}'")),
    }
}

/// Length of a frame of about `about` seconds that is a whole number of a world's own steps while nothing is faster than
/// `speed` [m/s]: shorter frames would shorten the steps.
pub fn whole_steps(world: &World, speed: f64, about: f64) -> f64 {
    let step = f64::from(world.courant * world.dx) / (f64::from(world.wave_speeds().1) + speed);
    // Some less, because compressed material is stiffer: one step more every now and then is two unequal ones, which
    // velocities that live half a step before positions answer with an error.
    (about / step).round().max(1.0) * step * 0.97
}

/// A solver at work, and what it took. It has the device to itself: what others keep there ends with it.
pub struct Play<'g> {
    gpu: &'g Gpu,
    /// The solver.
    pub solver: Box<dyn Solver + 'g>,
    wall: Duration,
    simulated: f64,
    substeps: u64,
    clamps: u64,
    particles: u64,
}

impl<'g> Play<'g> {
    /// A solver over `world` whose kernels are compiled.
    ///
    /// # Errors
    /// As [`solver`].
    pub fn new(gpu: &'g Gpu, world: &World, method: &str) -> Result<Self, String> {
        // Drivers compile at the first dispatch: another one takes a step first.
        let mut first = solver(gpu, world, method)?;
        first.frame(0.5 * world.step()).map_err(say)?;
        drop(first);
        free(gpu);
        Ok(Self {
            gpu,
            solver: solver(gpu, world, method)?,
            wall: Duration::ZERO,
            simulated: 0.0,
            substeps: 0,
            clamps: 0,
            particles: world.bodies.iter().map(|b| b.positions.len() as u64).sum(),
        })
    }

    /// Advances by `length` seconds.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn frame(&mut self, length: f64) -> Result<FrameStats, String> {
        let begin = Instant::now();
        let stats = self.solver.frame(length as f32).map_err(say)?;
        self.wall += begin.elapsed();
        self.simulated += length;
        self.substeps += u64::from(stats.substeps);
        let limits = [stats.clamped_velocity, stats.clamped_strain, stats.clamped_volume, stats.quarantined];
        self.clamps += limits.iter().map(|n| u64::from(*n)).sum::<u64>() + u64::from(stats.rejected);
        Ok(stats)
    }

    /// The particles.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn particles(&self) -> Result<Vec<Particle>, String> {
        self.gpu.read(self.solver.particles()).map_err(say)
    }

    /// Their deformation.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn deformations(&self) -> Result<Vec<Deformation>, String> {
        self.gpu.read(self.solver.deformations()).map_err(say)
    }

    /// Puts others in their place, before the first frame: for solvers that keep their state in particles.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn put(&self, particles: &[Particle], deformations: &[Deformation]) -> Result<(), String> {
        self.gpu.write(self.solver.particles(), 0, particles).map_err(say)?;
        self.gpu.write(self.solver.deformations(), 0, deformations).map_err(say)
    }

    /// Sums over body `index`.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn measure(&self, index: usize) -> Result<Measure, String> {
        self.solver.measure(index).map_err(say)
    }

    /// Mean position of the particles, in f64 [m].
    ///
    /// # Errors
    /// The device's refusal.
    pub fn center(&self) -> Result<[f64; 3], String> {
        let particles = self.particles()?;
        let n = particles.len() as f64;
        Ok(std::array::from_fn(|a| particles.iter().map(|p| f64::from(p.x[a])).sum::<f64>() / n))
    }

    /// Ends it.
    pub fn finish(self, error: f64) -> Outcome {
        let Self { gpu, solver, wall, simulated, substeps, clamps, particles } = self;
        drop(solver);
        free(gpu);
        Outcome { error, wall_s: wall.as_secs_f64(), simulated_s: simulated, substeps, clamps, particles }
    }
}

fn free(gpu: &Gpu) {
    gpu.free_arena("run");
    gpu.free_arena("grid");
}

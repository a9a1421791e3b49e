//! Contact with the matter of a grid that another solver has: sand, liquids and whatever else is not on a grid of its own.
//! What a body's surface gets, the nodes of that grid lose.

use physvideo_gpu::kernels::{self, Clock, Deformation, Facet, Grid, Particle, Touch, lagrangian};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Recording};

use super::Lagrangian;
use super::facets::Facets;
use super::pairs::Moved;
use super::reference::CONTACT;
use super::start::initial_particles;
use crate::scene::Material;
use crate::stages::solver::FrameStats;
use crate::world::World;

/// Buffers of all bodies of a world; those of the other solver, where there is one.
pub(in crate::stages) struct Host {
    pub particles: Buf<Particle>,
    pub deformations: Buf<Deformation>,
    pub bodies: Buf<kernels::Body>,
    pub clock: Buf<Clock>,
}

impl Host {
    /// Of a world that nobody else simulates.
    pub fn alone(gpu: &Gpu, world: &World) -> Result<Self, GpuError> {
        let (particles, deformations) = initial_particles(world);
        let bodies: Vec<_> = world.bodies.iter().map(|b| b.constants(world.gravity, world.dx)).collect();
        Ok(Self {
            particles: gpu.upload("run", "lagrangian/particles", &particles)?,
            deformations: gpu.upload("run", "lagrangian/deformations", &deformations)?,
            bodies: gpu.upload("run", "lagrangian/bodies", &bodies)?,
            clock: gpu.alloc("run", "lagrangian/clock", 1)?,
        })
    }
}

/// The grid of the other solver, as it is for now.
#[derive(Clone, Copy)]
pub(in crate::stages) struct Shared {
    pub grid: Grid,
    /// Slot + 1 of each block.
    pub table: Buf<u32>,
    /// Velocity [m/s] and mass [kg] of the nodes of each slot.
    pub nodes: Buf<[f32; 4]>,
    /// What each of them is given, three whole numbers a node.
    pub gifts: Buf<i32>,
}

/// The surface that meets it.
pub(super) struct Matter {
    facets: Buf<Facet>,
    touches: Buf<Touch>,
    saved: Buf<Touch>,
    count: u32,
    ranges: Vec<std::ops::Range<usize>>,
    constants: Constants,
    shared: Option<Shared>,
}

/// Impulse that one of the whole numbers stands for [kg m/s]: 2³¹ of them are that of 64 cells of the matter at the
/// fastest wave's speed, of which a step changes a part.
pub(in crate::stages) fn unit(world: &World, own: &[bool]) -> f64 {
    let cell = f64::from(world.dx).powi(3) * Other::of(world, own).density;
    64.0 * cell * f64::from(world.wave_speeds().1) / 2f64.powi(31)
}

/// What contact takes the matter of all other bodies for: the grid tells how much of it is where, not whose it is.
struct Other {
    /// Of the lightest [kg/m³]: heavier ones are met a little earlier, none sinks in.
    density: f64,
    /// Pressure for a depth, of the stiffest [Pa/m].
    stiffness: f64,
    /// The least.
    friction: f64,
}

impl Other {
    fn of(world: &World, own: &[bool]) -> Self {
        let others = || world.bodies.iter().zip(own).filter(|(_, own)| !**own).map(|(b, _)| b);
        let density = others().map(|b| f64::from(b.density)).fold(f64::INFINITY, f64::min);
        let modulus = others().map(|b| f64::from(b.density) * f64::from(b.wave_speed()).powi(2)).fold(0.0, f64::max);
        // No stiffer than the lightest of it stands at the steps there are.
        let most = density * f64::from(world.wave_speeds().1).powi(2);
        let slips = |b: &crate::world::Body| match b.material {
            Material::Liquid { .. } => 0.0,
            _ => f64::from(b.friction),
        };
        let friction = others().map(slips).fold(f64::INFINITY, f64::min);
        Self { density, stiffness: f64::from(CONTACT) * modulus.min(most) / f64::from(world.dx), friction }
    }
}

impl Matter {
    /// Uploads the surface; `beside`: something else has worked out pushes first.
    pub fn new(gpu: &Gpu, world: &World, own: &[bool], all: &Facets, beside: bool) -> Result<Self, GpuError> {
        let count = all.list.len() as u64;
        let other = Other::of(world, own);
        let constants = Constants::none()
            .with("BESIDE", f64::from(u8::from(beside)))
            .with("DENSITY", other.density)
            .with("STIFFNESS", other.stiffness)
            .with("FRICTION", other.friction)
            .with("UNIT", unit(world, own));
        Ok(Self {
            facets: gpu.upload("run", "lagrangian/shores", &all.list)?,
            touches: gpu.alloc("run", "lagrangian/touches", count)?,
            saved: gpu.alloc("run", "lagrangian/saved_touches", count)?,
            count: count as u32,
            ranges: all.ranges.clone(),
            constants,
            shared: None,
        })
    }

    /// Bytes that [`Matter::new`] allocates for so many facets.
    pub fn bytes(facets: usize) -> u64 {
        (facets * (size_of::<Facet>() + 2 * size_of::<Touch>())) as u64
    }

    pub fn facets(&self) -> u32 {
        self.count
    }

    /// Adds what the matter does to the pushes of obstacles and other bodies, and gives the opposite to the grid.
    pub fn record(&self, rec: &mut Recording, of: &Moved, groups: Groups) {
        let Some(Shared { grid, table, nodes, gifts }) = self.shared else { return };
        let Moved { cells, state, pushes, clock, .. } = *of;
        let Self { facets, touches, .. } = *self;
        let immediates = Grid { count: self.count, ..grid };
        let press = lagrangian::Press {
            cells,
            facets,
            u: state.u,
            v: state.v,
            table,
            nodes,
            touches_was: touches,
            touches,
            pushes,
            gifts,
            clock,
            immediates,
        };
        rec.call(&press, &self.constants, groups);
    }

    /// Energy of the springs of body `index` [J].
    pub fn energy(&self, gpu: &Gpu, index: usize) -> Result<f64, GpuError> {
        let touches = gpu.read(self.touches)?;
        let own = self.ranges.get(index).cloned().unwrap_or_default();
        Ok(own.map(|i| f64::from(touches[i].energy)).sum())
    }
}

/// What the solver with the grid asks of it.
impl Lagrangian<'_> {
    /// Says where the grid is from now on.
    pub(in crate::stages) fn share(&mut self, shared: Shared) {
        if let Some(matter) = &mut self.matter {
            matter.shared = Some(shared);
        }
    }

    /// All calls of a substep whose clock is the other's, after that one's nodes have their velocities.
    pub(in crate::stages) fn record_beside(&self, rec: &mut Recording, groups: impl Fn(usize) -> Groups) {
        self.record_step(rec, true, |items| groups(items as usize));
    }

    /// Keeps the state, for [`Lagrangian::record_back`].
    pub(in crate::stages) fn record_save(&self, rec: &mut Recording) {
        self.state.copy(&self.saved, rec);
        if let Some(pairs) = &self.pairs {
            pairs.record_save(rec);
        }
        if let Some(matter) = &self.matter {
            rec.copy(matter.touches, matter.saved);
        }
    }

    /// Returns to the state that was kept.
    pub(in crate::stages) fn record_back(&self, rec: &mut Recording) {
        self.saved.copy(&self.state, rec);
        if let Some(pairs) = &self.pairs {
            pairs.record_back(rec);
        }
        if let Some(matter) = &self.matter {
            rec.copy(matter.saved, matter.touches);
        }
    }

    /// Energy that its particles do not tell: of all springs of contact, and of thin parts that bend [J].
    pub(in crate::stages) fn untold(&self) -> Result<f64, GpuError> {
        let pushes = self.gpu.read(self.pushes)?;
        let mut sum: f64 = pushes.iter().step_by(4).map(|p| f64::from(p[3])).sum();
        sum += self.bends()?.iter().sum::<f64>();
        for index in 0..self.ranges.len() {
            sum += self.ties(index)?;
            if let Some(cores) = &self.cores {
                sum += cores.energy(self.gpu, index)?;
            }
        }
        Ok(sum)
    }

    /// Energy of body `index` in its contact with other bodies and with matter [J].
    pub(super) fn ties(&self, index: usize) -> Result<f64, GpuError> {
        let pairs = self.pairs.as_ref().map_or(Ok(0.0), |p| p.energy(self.gpu, index))?;
        Ok(pairs + self.matter.as_ref().map_or(Ok(0.0), |m| m.energy(self.gpu, index))?)
    }

    /// A frame from `time` [s] on in which the other solver has nothing that moves.
    pub(in crate::stages) fn frame_alone(&mut self, time: f64, length: f32) -> Result<FrameStats, GpuError> {
        self.time = time;
        let mut none = Recording::new("no matter");
        none.fill(self.pushes, 0);
        if let Some(matter) = &self.matter {
            none.fill(matter.touches, 0);
        }
        self.gpu.run(&none)?;
        self.frame(length)
    }
}

//! Elastic bodies on grids of their own, in total-Lagrangian form: the displacement of the nodes of a body's reference
//! grid is the only unknown, its particles are quadrature points, F = I + Σ u ⊗ ∇N and f = −Σ V0 P(F) ∇N with weights
//! that never change (for quadratic B-splines; de Vaucorbeil 2020). No transfer, no sort, no diffusion; bodies neither
//! tear nor flow. Parts closer than two cells at rest share nodes and act as glued, and no body feels itself; several push
//! each other by compliant surfaces, and what is on the grid of MPM where that hosts them (`matter`). Places are kept as
//! displacements in f32: far from where it started, a body's strain is rounded to 6e-8 of that way per cell.
//! Records a batch of substeps once and submits it until the device says that the frame is done.

mod clamp;
mod core;
mod facets;
mod fill;
mod frame;
mod lattice;
mod matter;
mod pairs;
mod play;
mod reference;
mod size;
mod start;
mod sums;
mod thin;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use physvideo_gpu::kernels::{self, Clock, Colliders, Deformation, Forces, Live, Particle, lagrangian, mpm};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Prepared, Recording};

use self::core::Cores;
use self::facets::Facets;
use self::frame::Items;
use self::matter::Matter;
use self::pairs::{Moved, Pairs};
use self::reference::Reference;
use self::start::{constants, shocked};
use self::thin::Thins;
use super::energy::{Budget, moves};
use super::solver::CALLS;
use crate::world::World;

pub(crate) use self::core::length;
pub use self::lattice::Unfit;
pub(super) use self::matter::{Host, Shared, unit};
pub use self::reference::{fit, fit_body};

/// Substeps in a command buffer.
const BATCH: u32 = 32;

/// Why there is no solver.
#[derive(Debug, thiserror::Error)]
pub enum LagrangianError {
    /// A body that cannot be on a grid of its own.
    #[error("'{0}' {1}")]
    Unfit(String, Unfit),
    /// The device's refusal.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// The solver over one world.
pub struct Lagrangian<'gpu> {
    gpu: &'gpu Gpu,
    particles: Buf<Particle>,
    deformations: Buf<Deformation>,
    bodies: Buf<kernels::Body>,
    solids: Buf<kernels::Solid>,
    forces: Buf<Forces>,
    colliders: Buf<Colliders>,
    clock: Buf<Clock>,
    /// For the clock it shares with MPM, which counts blocks of a grid there.
    live: Buf<Live>,
    nodes: Buf<kernels::ElasticNode>,
    cells: Buf<kernels::ElasticCell>,
    skins: Buf<kernels::Skin>,
    rests: Buf<kernels::Rest>,
    /// Cells with thin parts, and what integrates those, if there are any.
    thins: Option<Thins>,
    state: State,
    saved: State,
    /// What each cell gives to its 27 nodes [N].
    shares: Buf<[f32; 4]>,
    /// Forces of contact on each point at the surface and its faces [N], and their energy [J].
    pushes: Buf<[f32; 4]>,
    sums: Buf<kernels::Sums>,
    /// Contact of what is inside with obstacles that could get there.
    cores: Option<Cores>,
    /// Contact of the bodies with each other, where there are several.
    pairs: Option<Pairs>,
    /// Contact with the matter of a grid, where another solver has one.
    matter: Option<Matter>,
    sizes: kernels::Reference,
    constants: Constants,
    batch: Option<Prepared<'gpu>>,
    /// On the host: masses and places of the nodes, for sums in f64.
    lumps: Vec<Lump>,
    ranges: Vec<std::ops::Range<usize>>,
    skin_ranges: Vec<std::ops::Range<usize>>,
    held: Vec<f64>,
    /// Gravity that each body feels [m/s²].
    weights: Vec<[f64; 3]>,
    /// Frames are judged by their energy: nobody forces steps.
    judges: bool,
    /// What fields can bring, and how finely the work of obstacles is counted.
    budget: Budget,
    /// What one step of that count stands for [J].
    work_unit: f32,
    /// Energy that rounding may seem to make: a ten-thousandth of lifting everything by a cell [J].
    noise: f64,
    particle_ranges: Vec<std::ops::Range<u64>>,
    time: f64,
    courant: f32,
    wave_speed: f32,
    force_dt: f32,
    longest: f32,
    stop: Option<Arc<AtomicBool>>,
    /// Frames that go wrong are repeated with smaller steps.
    guarded: bool,
    /// There is something to touch; without it no contact is recorded.
    obstacles: bool,
    /// What limited the last step: a wave, or the approach to an obstacle on top of one [m/s].
    speed: f32,
    dx: f32,
}

/// What changes from step to step.
#[derive(Clone, Copy)]
struct State {
    /// Displacement of the nodes [m].
    u: Buf<[f32; 4]>,
    /// Their velocity [m/s], and in w the last step [s].
    v: Buf<[f32; 4]>,
    /// Where points at the surface took hold of an obstacle.
    grips: Buf<[f32; 4]>,
}

impl State {
    fn new(gpu: &Gpu, names: [&str; 3], nodes: u64, skins: u64) -> Result<Self, GpuError> {
        let alloc = |name: &str, len| gpu.alloc("run", &format!("lagrangian/{name}"), len);
        Ok(Self { u: alloc(names[0], nodes)?, v: alloc(names[1], nodes)?, grips: alloc(names[2], skins)? })
    }

    fn copy(&self, to: &Self, rec: &mut Recording) {
        rec.copy(self.u, to.u);
        rec.copy(self.v, to.v);
        rec.copy(self.grips, to.grips);
    }
}

/// A node as the host sums it.
struct Lump {
    /// Lumped mass [kg].
    m: f64,
    /// Place at rest [m].
    x: [f64; 3],
}

impl<'gpu> Lagrangian<'gpu> {
    /// Uploads a world.
    ///
    /// # Errors
    /// A body that does not qualify (see [`fit`]), or the device's refusal.
    pub fn new(gpu: &'gpu Gpu, world: &World) -> Result<Self, LagrangianError> {
        Self::build(gpu, world, &vec![true; world.bodies.len()], None)
    }

    /// Uploads those bodies of a world that are its `own`, beside the solver that moves the others.
    ///
    /// # Errors
    /// As [`Lagrangian::new`].
    pub(super) fn beside(gpu: &'gpu Gpu, world: &World, own: &[bool], host: Host) -> Result<Self, LagrangianError> {
        Self::build(gpu, world, own, Some(host))
    }

    fn build(gpu: &'gpu Gpu, world: &World, own: &[bool], host: Option<Host>) -> Result<Self, LagrangianError> {
        let unfit = |(i, why): (usize, Unfit)| LagrangianError::Unfit(world.bodies[i].name.clone(), why);
        let reference = Reference::new(world, own).map_err(unfit)?;
        let damped = world.bodies.iter().zip(own).any(|(b, own)| *own && b.damping > 0.0);
        let constants = constants(world)
            .with("MIRRORED", f64::from(u8::from(reference.mirrored())))
            .with("DAMPED", f64::from(u8::from(damped)))
            .with("SHOCKED", f64::from(u8::from(shocked(world, own))))
            .with("CURVED", f64::from(u8::from(world.colliders.iter().any(core::curved))))
            .with("COUNTS_WORK", f64::from(u8::from(world.colliders.iter().any(moves))))
            .with("MEETS", f64::from(u8::from(!world.colliders.is_empty() || world.bodies.len() > 1)));
        let obstacles = !world.colliders.is_empty();
        let several = own.iter().filter(|own| **own).count() > 1;
        let facets =
            if several || host.is_some() { Some(Facets::new(world, &reference, own).map_err(unfit)?) } else { None };
        let matter = match (&facets, &host) {
            (Some(facets), Some(_)) => Some(Matter::new(gpu, world, own, facets, obstacles || several)?),
            _ => None,
        };
        let pairs = match facets {
            Some(facets) if several => Some(Pairs::new(gpu, facets, world.dx, &constants, obstacles)?),
            _ => None,
        };
        let host = match host {
            Some(host) => host,
            None => Host::alone(gpu, world)?,
        };
        let mut particle_ranges = Vec::new();
        let mut first = 0;
        for body in &world.bodies {
            particle_ranges.push(first..first + body.positions.len() as u64);
            first += body.positions.len() as u64;
        }
        let (forces, colliders) = (world.forces(), world.obstacles());
        let sizes = kernels::Reference {
            dx: world.dx,
            nodes: reference.nodes.len() as u32,
            cells: reference.cells.len() as u32,
            skins: reference.skins.len() as u32,
            points: reference.rests.len() as u32,
            // Where nothing can push there is one call for all.
            thin: reference.thin.cells.len() as u32,
            touched: if obstacles || pairs.is_some() || matter.is_some() { reference.touched } else { 0 },
        };
        let (nodes, skins) = (u64::from(sizes.nodes), u64::from(sizes.skins));
        let state = State::new(gpu, ["u", "v", "grips"], nodes, skins)?;
        gpu.write(state.v, 0, &reference.velocities)?;
        let lump = |(n, m): (&kernels::ElasticNode, &f64)| Lump { m: *m, x: n.x.map(f64::from) };
        let lumps = reference.nodes.iter().zip(&reference.masses).map(lump).collect();
        let mut solver = Self {
            gpu,
            particles: host.particles,
            deformations: host.deformations,
            bodies: host.bodies,
            solids: gpu.upload("run", "lagrangian/solids", &reference.solids)?,
            forces: gpu.upload("run", "lagrangian/forces", &[forces])?,
            colliders: gpu.upload("run", "lagrangian/colliders", &[colliders])?,
            clock: host.clock,
            live: gpu.alloc("run", "lagrangian/live", 1)?,
            nodes: gpu.upload("run", "lagrangian/nodes", &reference.nodes)?,
            cells: gpu.upload("run", "lagrangian/cells", &reference.cells)?,
            skins: gpu.upload("run", "lagrangian/skins", &reference.skins)?,
            rests: gpu.upload("run", "lagrangian/rests", &reference.rests)?,
            thins: Thins::new(gpu, &reference.thin, &reference.cells)?,
            state,
            saved: State::new(gpu, ["saved_u", "saved_v", "saved_grips"], nodes, skins)?,
            shares: gpu.alloc("run", "lagrangian/shares", 27 * u64::from(sizes.cells))?,
            pushes: gpu.alloc("run", "lagrangian/pushes", 4 * skins)?,
            sums: gpu.alloc("run", "lagrangian/sums", u64::from(sizes.points).div_ceil(64))?,
            cores: if core::pierced(world, own) { Some(Cores::new(gpu, &reference.cells)?) } else { None },
            sizes,
            constants,
            batch: None,
            lumps,
            ranges: reference.ranges,
            skin_ranges: reference.skin_ranges,
            held: reference.held,
            noise: 1e-4
                * reference.masses.iter().sum::<f64>()
                * f64::from(world.dx)
                * world.gravity.iter().map(|g| f64::from(*g).abs()).sum::<f64>(),
            weights: reference.solids.iter().map(|s| s.gravity.map(f64::from)).collect(),
            judges: world.force_dt.is_none(),
            budget: Budget::new(world),
            work_unit: 1.0,
            particle_ranges,
            time: 0.0,
            courant: world.courant,
            wave_speed: world.wave_speeds().1,
            force_dt: world.force_dt.unwrap_or(0.0),
            longest: world.longest_step(),
            stop: None,
            guarded: world.force_dt.is_none(),
            obstacles,
            // Bodies may begin within a step of each other, or of an obstacle.
            speed: if pairs.is_some() || obstacles { world.wave_speeds().1 + 3.0 * world.start_speed() } else { 0.0 },
            pairs,
            matter,
            dx: world.dx,
        };
        // Bodies may begin in contact, whose energy counts from the start.
        if solver.pairs.is_some() {
            solver.finish()?
        } else {
            solver.sample()?
        }
        Ok(solver)
    }

    /// Bodies' ranges in the particle buffer.
    pub fn ranges(&self) -> &[std::ops::Range<u64>] {
        &self.particle_ranges
    }

    /// Number of nodes of all bodies.
    pub fn nodes(&self) -> u32 {
        self.sizes.nodes
    }

    /// Overwrites displacement [m] and velocity [m/s] of the nodes: `of` gets the place of each at rest. For tests and
    /// for who goes on from a known state; held nodes are the caller's to spare.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn set(&mut self, of: impl Fn([f64; 3]) -> ([f64; 3], [f64; 3])) -> Result<(), GpuError> {
        let both: Vec<_> = self.lumps.iter().map(|n| of(n.x)).collect();
        let as_vec4 = |v: [f64; 3]| [v[0] as f32, v[1] as f32, v[2] as f32, 0.0];
        self.gpu.write(self.state.u, 0, &both.iter().map(|b| as_vec4(b.0)).collect::<Vec<_>>())?;
        self.gpu.write(self.state.v, 0, &both.iter().map(|b| as_vec4(b.1)).collect::<Vec<_>>())?;
        // The first step has to know of waves in what is squeezed.
        let mut rec = Recording::new("waves");
        self.record_forces(&mut rec, &|items| Groups::Direct([self.items(items).div_ceil(64), 1, 1]));
        self.gpu.run(&rec)?;
        self.speed = f32::from_bits(self.gpu.read(self.clock)?[0].speed_bits);
        self.sample()
    }

    /// One substep: clock, contact, forces, nodes.
    pub fn record_substep(&self, rec: &mut Recording) {
        let k = &self.constants;
        let Self { clock, live, .. } = *self;
        rec.call(&mpm::Clock { clock, live }, k, Groups::Direct([1, 1, 1]));
        let counted = std::mem::offset_of!(Clock, runs) as u64;
        self.record_step(rec, false, |items| {
            Groups::Indirect(clock.erase(), counted + 16 * (CALLS + items as usize) as u64)
        });
    }

    /// Contact (with a grid's matter where it is `shared`), forces, nodes, with the step that the clock says; `groups` of the items of a call. Each call has its own
    /// number of them: on a software driver a lane that has nothing to do takes as long as the others.
    fn record_step(&self, rec: &mut Recording, shared: bool, groups: impl Fn(Items) -> Groups) {
        let k = &self.constants;
        let Self { cells, solids, skins, colliders, forces, nodes, clock, shares, pushes, .. } = *self;
        let State { u, v, grips } = self.state;
        let immediates = self.sizes;
        if self.obstacles {
            let contact = lagrangian::Contact {
                cells,
                solids,
                skins,
                u,
                v,
                colliders,
                grips_was: grips,
                grips,
                pushes,
                clock,
                immediates,
            };
            rec.call(&contact, k, groups(Items::Skins));
        }
        if let Some(pairs) = &self.pairs {
            let moved = Moved { cells, solids, state: self.state, pushes, clock };
            pairs.record(rec, &moved, groups(Items::Facets));
        }
        if let Some(matter) = self.matter.as_ref().filter(|_| shared) {
            matter.record(rec, &Moved { cells, solids, state: self.state, pushes, clock }, groups(Items::Facets));
        }
        self.record_forces(rec, &groups);
        let advance =
            lagrangian::Advance { nodes, solids, shares, forces, u_was: u, v_was: v, u, v, clock, immediates };
        rec.call(&advance, k, groups(Items::Nodes));
    }

    /// What deforms and what is pushed, on the nodes of each cell.
    fn record_forces(&self, rec: &mut Recording, groups: &dyn Fn(Items) -> Groups) {
        let k = &self.constants;
        let Self { cells, solids, clock, shares, pushes, sizes: immediates, .. } = *self;
        let State { u, v, .. } = self.state;
        let force = lagrangian::Force { cells, solids, u, v, pushes, shares, clock, immediates };
        for (pushed, items) in [(1.0, Items::Touched), (0.0, Items::Inside)] {
            if self.items(items) > 0 {
                rec.call(&force, &k.clone().with("PUSHED", pushed), groups(items));
            }
        }
        if let Some(Thins { cells: thins, places, .. }) = &self.thins {
            let (thins, places, shares_was) = (*thins, *places, shares);
            let thin = lagrangian::Thin { cells, solids, thins, places, u, v, shares_was, shares, clock, immediates };
            rec.call(&thin, k, groups(Items::Thin));
        }
        if let Some(cores) = &self.cores {
            rec.call(&cores.call(self), k, groups(Items::Cells));
        }
    }

    /// Brings the particles up to date with the nodes.
    pub(super) fn sample(&mut self) -> Result<(), GpuError> {
        let Self { cells, rests, particles, deformations, sizes: immediates, .. } = *self;
        let State { u, v, .. } = self.state;
        let mut rec = Recording::new("sample");
        let sample = lagrangian::Sample { cells, u, v, rests, particles, deformations, immediates };
        rec.each(&sample, &self.constants, u64::from(self.sizes.points));
        self.gpu.run(&rec).map(|_| ())
    }
}

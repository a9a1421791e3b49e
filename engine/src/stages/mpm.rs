//! MLS-MPM of elastic bodies (Hu 2018; Stomakhin 2013): particles carry state, the grid carries one substep.
//! Records a batch of substeps once and submits it until the device says that the frame is done.

use bytemuck::Zeroable;
use physvideo_gpu::kernels::{self, Clock, Colliders, Deformation, Forces, Particle, Sums, mpm};
use physvideo_gpu::{Buf, Constants, DeviceKind, Feature, Gpu, GpuError, Groups, Prepared, Recording};

use super::cells::{self, Cells, PARTICLE_GROUPS};
use crate::world::World;

/// How particles give to the grid. All three give the same sums up to rounding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum P2g {
    /// A lane a cell, no atomics; same bits on every run. For CPU devices.
    Cell,
    /// A lane a particle, integer atomics in workgroup memory; same bits on every run. For GPUs.
    Fixed,
    /// A lane a particle, subgroup sums and native float atomics; bits vary from run to run.
    Float,
}

/// Choices that do not change what is simulated.
#[derive(Clone, Copy, Debug)]
pub struct Method {
    /// Transfer to the grid; absent: chosen by the device.
    pub p2g: Option<P2g>,
    /// Same bits on every run.
    pub deterministic: bool,
    /// Stress and deformation by the gradient of the B-spline instead of the MLS form.
    pub true_gradient: bool,
    /// Substeps in a command buffer.
    pub batch: u32,
}

impl Default for Method {
    fn default() -> Self {
        Self { p2g: None, deterministic: true, true_gradient: true, batch: 32 }
    }
}

/// What happened in a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameStats {
    /// Substeps taken, those of rejected attempts included.
    pub substeps: u32,
    /// Smallest and largest substep [s].
    pub dt: (f32, f32),
    /// Grid nodes slowed down to the speed limit.
    pub clamped_velocity: u32,
    /// Particle updates whose stretch was limited.
    pub clamped_strain: u32,
    /// Particle updates whose compression was refused.
    pub clamped_volume: u32,
    /// Particles taken out: not finite, or outside the grid.
    pub quarantined: u32,
    /// Attempts at the frame that were taken back and repeated with half the step.
    pub rejected: u32,
}

/// Sums over one body.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Measure {
    /// Mass [kg].
    pub mass: f64,
    /// Momentum [kg m/s].
    pub momentum: [f64; 3],
    /// Angular momentum of the particles about the origin [kg m²/s], without the part in C.
    pub spin: [f64; 3],
    /// Kinetic energy [J].
    pub kinetic: f64,
    /// Elastic energy [J].
    pub elastic: f64,
    /// Σ m z [kg m].
    pub height: f64,
    /// Particles in quarantine.
    pub quarantined: u32,
    /// Largest speed [m/s].
    pub speed: f64,
}

/// The solver over one world.
pub struct Mpm<'gpu> {
    gpu: &'gpu Gpu,
    /// The particles, body after body.
    pub particles: Buf<Particle>,
    /// Their deformation.
    pub deformations: Buf<Deformation>,
    bodies: Buf<kernels::Body>,
    forces: Buf<Forces>,
    clock: Buf<Clock>,
    colliders: Buf<Colliders>,
    saved: (Buf<Particle>, Buf<Deformation>),
    sums: Buf<Sums>,
    tiles: Buf<[f32; 4]>,
    nodes: Buf<[f32; 4]>,
    cells: Cells,
    constants: Constants,
    method: Method,
    p2g: P2g,
    batch: Option<Prepared<'gpu>>,
    time: f64,
    courant: f32,
    wave_speed: f32,
    force_dt: f32,
    /// Attempts that may be taken back in a frame.
    patience: u32,
    speed: f32,
    dx: f32,
    ranges: Vec<std::ops::Range<u64>>,
}

/// Vectors of the fields and obstacles that fit in one scene.
const MOST: usize = 16;

impl<'gpu> Mpm<'gpu> {
    /// Uploads a world.
    ///
    /// # Errors
    /// The device's refusal of a buffer or a kernel.
    pub fn new(gpu: &'gpu Gpu, world: &World, method: Method) -> Result<Self, GpuError> {
        let count: u64 = world.bodies.iter().map(|b| b.positions.len() as u64).sum();
        let (particles, deformations) = initial_state(world);
        let mut ranges = Vec::new();
        let mut first = 0;
        for body in &world.bodies {
            ranges.push(first..first + body.positions.len() as u64);
            first += body.positions.len() as u64;
        }
        let grid = cells::grid(world.domain, world.dx);
        let touched = cells::blocks_touched(&grid, world.bodies.iter().flat_map(|b| b.positions.iter().copied()));
        let capacity = capacity(&grid, touched);
        let mut forces = Forces::zeroed();
        forces.gravity[..3].copy_from_slice(&world.gravity);
        forces.count = world.fields.len().min(MOST) as u32;
        for (slot, field) in forces.d.iter_mut().zip(&world.fields) {
            *slot = *field;
        }
        let mut colliders = Colliders::zeroed();
        colliders.count = world.colliders.len().min(MOST) as u32;
        for (slot, collider) in colliders.d.iter_mut().zip(&world.colliders) {
            *slot = *collider;
        }
        let p2g = method.p2g.unwrap_or(match gpu.info.kind {
            DeviceKind::Cpu => P2g::Cell,
            _ if !method.deterministic && gpu.has(Feature::FloatAtomic) && gpu.has(Feature::Subgroup) => P2g::Float,
            _ => P2g::Fixed,
        });
        let speed = world
            .bodies
            .iter()
            .flat_map(|b| &b.velocities)
            .map(|v| v.iter().map(|c| c * c).sum::<f32>())
            .fold(0.0, f32::max);
        let mut mpm = Self {
            gpu,
            particles: gpu.upload("run", "mpm/particles", &particles)?,
            deformations: gpu.upload("run", "mpm/deformations", &deformations)?,
            bodies: gpu.upload(
                "run",
                "mpm/bodies",
                &world.bodies.iter().map(crate::world::Body::constants).collect::<Vec<_>>(),
            )?,
            forces: gpu.upload("run", "mpm/forces", &[forces])?,
            clock: gpu.alloc("run", "mpm/clock", 1)?,
            colliders: gpu.upload("run", "mpm/colliders", &[colliders])?,
            saved: (
                gpu.alloc("run", "mpm/saved_particles", count)?,
                gpu.alloc("run", "mpm/saved_deformations", count)?,
            ),
            sums: gpu.alloc("run", "mpm/sums", count.div_ceil(64))?,
            tiles: gpu.alloc("grid", "mpm/tiles", 216 * u64::from(capacity))?,
            nodes: gpu.alloc("grid", "mpm/nodes", 64 * u64::from(capacity))?,
            cells: Cells::new(gpu, grid, count, capacity)?,
            constants: constants(world, method),
            method,
            p2g,
            batch: None,
            time: 0.0,
            courant: world.courant,
            wave_speed: world.bodies.iter().map(crate::world::Body::wave_speed).fold(0.0, f32::max),
            force_dt: world.force_dt.unwrap_or(0.0),
            patience: 2,
            speed: speed.sqrt(),
            dx: world.dx,
            ranges,
        };
        mpm.update_stress()?;
        Ok(mpm)
    }

    /// Bytes that [`Mpm::new`] will allocate for `particles` particles touching `blocks` blocks, before any is made.
    pub fn bytes(world: &World, particles: u64, blocks: u64) -> u64 {
        let grid = cells::grid(world.domain, world.dx);
        let capacity = capacity(&grid, blocks);
        let each = (2 * (size_of::<Particle>() + size_of::<Deformation>()) + 1) as u64;
        each * particles + 16 * 280 * u64::from(capacity) + Cells::bytes(&grid, particles, capacity)
    }

    /// Which transfer is used.
    pub fn p2g(&self) -> P2g {
        self.p2g
    }

    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Bodies' ranges in the particle buffer.
    pub fn ranges(&self) -> &[std::ops::Range<u64>] {
        &self.ranges
    }

    fn particle_groups(&self) -> Groups {
        Groups::Indirect(self.clock.erase(), PARTICLE_GROUPS)
    }

    /// One substep: clear, clock, sort, P2G, grid, G2P.
    pub fn record_substep(&self, rec: &mut Recording) {
        let k = &self.constants;
        let Cells { grid: immediates, table, list, counts, starts, order, live, .. } = self.cells;
        let Self { particles, deformations, bodies, forces, clock, colliders, tiles, nodes, .. } = *self;
        self.cells.record_clear(rec, k);
        rec.call(&mpm::Clock { clock, live }, k, Groups::Direct([1, 1, 1]));
        self.cells.record_sort(rec, k, particles, clock);
        let blocks = self.cells.block_groups();
        match self.p2g {
            P2g::Cell => rec.call(
                &mpm::P2g { particles, bodies, order, starts, counts, tiles, immediates, clock, forces },
                k,
                blocks,
            ),
            P2g::Fixed => rec.call(
                &mpm::P2gFixed { particles, bodies, order, starts, counts, tiles, immediates, clock, forces },
                k,
                blocks,
            ),
            P2g::Float => rec.call(
                &mpm::P2gFloat {
                    particles,
                    bodies,
                    order,
                    starts,
                    counts,
                    tiles: tiles.cast(),
                    immediates,
                    clock,
                    forces,
                },
                k,
                blocks,
            ),
        }
        rec.call(
            &mpm::Grid { tiles, table, list, live: live.cast(), nodes, immediates, clock, colliders },
            k,
            self.cells.node_groups(),
        );
        let g2p =
            mpm::G2p { particles, deformations, bodies, order, starts, counts, table, list, nodes, immediates, clock };
        rec.call(&g2p, k, blocks);
    }

    fn prepare(&mut self) -> Result<(), GpuError> {
        if self.batch.is_none() {
            let mut rec = Recording::new("substeps");
            for _ in 0..self.method.batch.max(1) {
                self.record_substep(&mut rec);
            }
            self.batch = Some(self.gpu.prepare(&rec)?);
        }
        Ok(())
    }

    /// Begins a frame of `length` seconds without running it, for whoever submits substeps recorded with
    /// [`Mpm::record_substep`].
    ///
    /// # Errors
    /// The device's refusal.
    pub fn start_clock(&self, length: f32) -> Result<(), GpuError> {
        self.begin(length, self.courant)
    }

    fn begin(&self, length: f32, courant: f32) -> Result<(), GpuError> {
        let clock = Clock {
            frame_start: self.time as f32,
            frame_length: length,
            dx: self.dx,
            courant,
            wave_speed: self.wave_speed,
            force_dt: self.force_dt,
            speed_bits: self.speed.to_bits(),
            particles: self.particles_in_use(),
            particle_groups: [self.particles_in_use().div_ceil(64), 1, 1],
            ..Default::default()
        };
        self.gpu.write(self.clock, 0, &[clock])
    }

    fn particles_in_use(&self) -> u32 {
        self.ranges.last().map_or(0, |r| r.end as u32)
    }

    fn update_stress(&mut self) -> Result<(), GpuError> {
        self.begin(1.0, self.courant)?;
        let Self { particles, deformations, bodies, clock, .. } = *self;
        let mut rec = Recording::new("stress");
        rec.call(&mpm::Stress { particles, deformations, bodies, clock }, &self.constants, self.particle_groups());
        self.gpu.run(&rec).map(|_| ())
    }

    /// Runs batches until the device says that `length` seconds have passed, without looking at the counters.
    fn advance(&mut self, length: f32, courant: f32) -> Result<Clock, GpuError> {
        self.begin(length, courant)?;
        self.prepare()?;
        loop {
            if let Some(batch) = &self.batch {
                batch.submit()?;
            }
            let clock = self.gpu.read(self.clock)?[0];
            if clock.particle_groups[0] == 0 {
                return Ok(clock);
            }
        }
    }

    /// Advances by one frame of `length` seconds. A frame in which particles were lost or nodes ran away is taken
    /// back and repeated with half the Courant number, twice at most, and no more in this run once that did not help; what remains is counted.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn frame(&mut self, length: f32) -> Result<FrameStats, GpuError> {
        let mut stats = FrameStats::default();
        if self.particles_in_use() == 0 {
            self.time += f64::from(length);
            return Ok(stats);
        }
        let mut save = Recording::new("save");
        save.copy(self.particles, self.saved.0);
        save.copy(self.deformations, self.saved.1);
        self.gpu.run(&save)?;
        let mut courant = self.courant;
        loop {
            let clock = self.advance(length, courant)?;
            stats.substeps += clock.substeps;
            let full = self.gpu.read(self.cells.live)?[0].overflow > 0;
            let bad = clock.clamped_velocity + clock.quarantined > 0 && self.force_dt == 0.0;
            if full || (bad && stats.rejected < self.patience) {
                let mut back = Recording::new("back");
                back.copy(self.saved.0, self.particles);
                back.copy(self.saved.1, self.deformations);
                self.gpu.run(&back)?;
                if full {
                    self.make_room()?;
                } else {
                    stats.rejected += 1;
                    courant *= 0.5;
                }
                continue;
            }
            if bad && stats.rejected == self.patience {
                // Smaller steps did not help; trying again at every frame would cost seven times the work.
                self.patience = 0;
            }
            self.speed = f32::from_bits(clock.speed_bits);
            stats.dt = (clock.dt_min, clock.dt_max);
            stats.clamped_velocity = clock.clamped_velocity;
            stats.clamped_strain = clock.clamped_strain;
            stats.clamped_volume = clock.clamped_volume;
            stats.quarantined = clock.quarantined;
            self.time += f64::from(length);
            return Ok(stats);
        }
    }

    /// Doubles the number of blocks there is room for.
    fn make_room(&mut self) -> Result<(), GpuError> {
        let grid = self.cells.grid;
        let dense: u64 = grid.blocks.iter().map(|b| u64::from(*b)).product();
        let capacity = (2 * u64::from(self.cells.capacity)).min(dense) as u32;
        self.batch = None;
        self.tiles = self.gpu.alloc("run", "mpm/tiles", 216 * u64::from(capacity))?;
        self.nodes = self.gpu.alloc("run", "mpm/nodes", 64 * u64::from(capacity))?;
        self.gpu.free_arena("grid");
        self.cells = Cells::new(self.gpu, grid, u64::from(self.particles_in_use()), capacity)?;
        Ok(())
    }

    /// Sums over body `index`.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn measure(&self, index: usize) -> Result<Measure, GpuError> {
        let count = self.particles_in_use();
        let immediates = kernels::Only { body: index as u32, count };
        let Self { particles, deformations, bodies, sums, .. } = *self;
        let mut rec = Recording::new("measure");
        rec.each(
            &mpm::Measure { particles, deformations, bodies, sums, immediates },
            &self.constants,
            u64::from(count),
        );
        self.gpu.run(&rec)?;
        let mut out = Measure::default();
        for s in self.gpu.read(sums)? {
            for a in 0..3 {
                out.momentum[a] += f64::from(s.momentum[a]);
                out.spin[a] += f64::from(s.spin[a]);
            }
            out.mass += f64::from(s.momentum[3]);
            out.kinetic += f64::from(s.spin[3]);
            out.elastic += f64::from(s.elastic);
            out.height += f64::from(s.height);
            out.quarantined += s.lost as u32;
            out.speed = out.speed.max(f64::from(s.speed));
        }
        Ok(out)
    }
}

/// Room for the blocks touched at the start and as many more, their neighbours included; never more than all.
fn capacity(grid: &kernels::Grid, touched: u64) -> u32 {
    let dense: u64 = grid.blocks.iter().map(|b| u64::from(*b)).product();
    (8 * touched + 64).min(dense) as u32
}

/// Share of the lightest particle's mass below which a node is one at the rim.
const SPARSE: f32 = 1e-2;

/// Overrides: the members of each family that this world uses, and the gradient.
fn constants(world: &World, method: Method) -> Constants {
    let material = |kind| world.bodies.iter().any(|b| b.constants().material == kind);
    let field = |kind| world.fields.iter().any(|f| f.kind == kind);
    let shape = |kind| world.colliders.iter().any(|c| c.shape == kind);
    let flag = |on: bool| if on { 1.0 } else { 0.0 };
    let lightest = world.bodies.iter().map(|b| b.density * b.particle_volume).fold(f32::MAX, f32::min);
    Constants::none()
        .with("TRUE_GRADIENT", flag(method.true_gradient))
        .with("SPARSE", f64::from(SPARSE * lightest))
        .with("MATERIAL_COROTATED_USED", flag(material(1)))
        .with("MATERIAL_NEO_HOOKEAN_USED", flag(material(2)))
        .with("FIELD_UNIFORM_USED", flag(field(1)))
        .with("FIELD_WIND_USED", flag(field(2)))
        .with("FIELD_POINT_USED", flag(field(3)))
        .with("SHAPE_PLANE_USED", flag(shape(1)))
        .with("SHAPE_BALL_USED", flag(shape(2)))
        .with("SHAPE_BOX_USED", flag(shape(3)))
        .with("SHAPE_ROOM_USED", flag(shape(4)))
}

fn initial_state(world: &World) -> (Vec<Particle>, Vec<Deformation>) {
    let mut particles = Vec::new();
    let mut deformations = Vec::new();
    for (tag, body) in world.bodies.iter().enumerate() {
        for (i, x) in body.positions.iter().enumerate() {
            let mut p = Particle::zeroed();
            p.x = *x;
            p.v = body.velocities.get(i).copied().unwrap_or_default();
            p.m = body.density * body.particle_volume;
            p.tag = tag as u32 | if body.pinned.get(i) == Some(&true) { super::mpm::PINNED } else { 0 };
            particles.push(p);
            let mut d = Deformation::zeroed();
            (d.f0[0], d.f1[1], d.f2[2]) = (1.0, 1.0, 1.0);
            d.f0[3] = body.particle_volume;
            deformations.push(d);
        }
    }
    (particles, deformations)
}

/// Flag of a particle that is held (`PINNED` in WGSL).
pub const PINNED: u32 = 0x4000_0000;
/// Flag of a particle that was taken out (`QUARANTINED` in WGSL).
pub const QUARANTINED: u32 = 0x8000_0000;

//! SPH of liquids over number densities (Solenthaler & Pajarola 2008), pressure by an equation of state (WCSPH) or by
//! two solves that the device ends itself (DFSPH, Bender & Koschier 2015). Records steps once and submits them until the
//! device says that the frame is done.

mod frame;
mod start;
mod viscous;

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use physvideo_gpu::kernels::{
    self, Clock, Colliders, Crowd, Deformation, Descent, Forces, Local, Particle, Solve, Sums, mpm, sph,
};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Prepared, Recording};

use self::start::{NEIGHBOURS, constants, initial_state, slots};
use self::viscous::{Step, Viscous};
use super::cells::{self, Cells, PARTICLE_GROUPS};
use super::solver::{FrameStats, Measure, Solver};
use crate::fluid::{Fluid, Limits, limits};
use crate::scene::Pressure;
use crate::world::World;

/// Most iterations of a step's density solve, and of its divergence solve. A solve that needs more is counted, and goes
/// on in the next step from where it was.
pub const MOST_ITERATIONS: [u32; 2] = [40, 20];

/// The solver over one world, whose bodies are all of SPH.
pub struct Sph<'gpu> {
    gpu: &'gpu Gpu,
    /// The particles, body after body. After a step the last vector of each holds s = ρ/ρ0, the pressure [Pa], and what
    /// the two solves found of that divided by s² [Pa].
    pub particles: Buf<Particle>,
    deformations: Buf<Deformation>,
    saved: Buf<Particle>,
    bodies: Buf<kernels::Body>,
    forces: Buf<Forces>,
    clock: Buf<Clock>,
    colliders: Buf<Colliders>,
    sums: Buf<Sums>,
    solve: Buf<Solve>,
    hot: Hot,
    viscous: Option<Viscous>,
    cells: Cells,
    constants: Constants,
    fluid: Fluid,
    limits: Limits,
    force_dt: f32,
    courant: f32,
    /// Frames since one was taken back.
    calm: u32,
    batch: Option<Prepared<'gpu>>,
    time: f64,
    speed: f32,
    stop: Option<Arc<AtomicBool>>,
    guarded: bool,
    count: u32,
}

/// What a step works with, in the order of the cells.
#[derive(Clone, Copy, Debug)]
struct Hot {
    places: Buf<[f32; 4]>,
    moves: Buf<[f32; 4]>,
    warm: Buf<[f32; 4]>,
    numbers: Buf<u32>,
    spots: Buf<u32>,
    lists: Buf<u32>,
    found: Buf<u32>,
    crowds: Buf<Crowd>,
    locals: Buf<Local>,
    points: Buf<[f32; 4]>,
    flows: Buf<[f32; 4]>,
    flown: Buf<[f32; 4]>,
    pushes: Buf<[f32; 4]>,
    wants: Buf<u32>,
    stirs: Buf<u32>,
    lasts: Buf<u32>,
}

impl Hot {
    /// Bytes of each particle.
    const BYTES: u64 = 7 * 16 + 6 * 4 + 4 * NEIGHBOURS + (size_of::<Crowd>() + size_of::<Local>()) as u64;

    fn new(gpu: &Gpu, count: u64) -> Result<Self, GpuError> {
        Ok(Self {
            places: gpu.alloc("run", "sph/places", count)?,
            moves: gpu.alloc("run", "sph/moves", count)?,
            warm: gpu.alloc("run", "sph/warm", count)?,
            numbers: gpu.alloc("run", "sph/numbers", count)?,
            spots: gpu.alloc("run", "sph/spots", count)?,
            lists: gpu.alloc("run", "sph/lists", NEIGHBOURS * count)?,
            found: gpu.alloc("run", "sph/found", count)?,
            crowds: gpu.alloc("run", "sph/crowds", count)?,
            locals: gpu.alloc("run", "sph/locals", count)?,
            points: gpu.alloc("run", "sph/points", count)?,
            flows: gpu.alloc("run", "sph/flows", count)?,
            flown: gpu.alloc("run", "sph/flown", count)?,
            pushes: gpu.alloc("run", "sph/pushes", count)?,
            wants: gpu.alloc("run", "sph/wants", count)?,
            lasts: gpu.alloc("run", "sph/lasts", count)?,
            stirs: gpu.upload("run", "sph/stirs", &vec![0; count as usize])?,
        })
    }
}

impl<'gpu> Sph<'gpu> {
    /// Uploads a world.
    ///
    /// # Errors
    /// The device's refusal of a buffer or a kernel.
    pub fn new(gpu: &'gpu Gpu, world: &World) -> Result<Self, GpuError> {
        let (particles, deformations) = initial_state(world);
        let count = particles.len() as u64;
        let grid = cells::grid(world.domain, world.cell());
        let (forces, colliders) = (world.forces(), world.obstacles());
        let bodies: Vec<_> = world.bodies.iter().map(|b| b.constants(world.gravity, world.dx)).collect();
        Ok(Self {
            gpu,
            particles: gpu.upload("run", "sph/particles", &particles)?,
            deformations: gpu.upload("run", "sph/deformations", &deformations)?,
            saved: gpu.alloc("run", "sph/saved", count)?,
            bodies: gpu.upload("run", "sph/bodies", &bodies)?,
            forces: gpu.upload("run", "sph/forces", &[forces])?,
            clock: gpu.alloc("run", "sph/clock", 1)?,
            colliders: gpu.upload("run", "sph/colliders", &[colliders])?,
            sums: gpu.alloc("run", "sph/sums", count.div_ceil(64))?,
            solve: gpu.upload("run", "sph/solve", &[Solve::default()])?,
            hot: Hot::new(gpu, count)?,
            viscous: limits(world).implicit.then(|| Viscous::new(gpu, count)).transpose()?,
            cells: Cells::new(gpu, grid, count, slots(world, &grid), count.max(1) as u32)?,
            constants: constants(world),
            fluid: world.fluid,
            limits: limits(world),
            force_dt: world.force_dt.unwrap_or(0.0),
            courant: limits(world).courant,
            calm: 0,
            batch: None,
            time: 0.0,
            speed: start::fastest(world) + limits(world).speed,
            stop: None,
            guarded: world.force_dt.is_none(),
            count: count as u32,
        })
    }

    /// Bytes that [`Sph::new`] will allocate.
    pub fn bytes(world: &World) -> u64 {
        let particles: u64 = world.bodies.iter().map(|b| b.positions.len() as u64).sum();
        let grid = cells::grid(world.domain, world.cell());
        let each = (2 * size_of::<Particle>() + size_of::<Deformation>() + 1) as u64 + Hot::BYTES;
        let each = each + if limits(world).implicit { Viscous::BYTES } else { 0 };
        each * particles + Cells::bytes(&grid, particles, slots(world, &grid), particles.max(1) as u32)
    }

    /// One step: sort, neighbours, surroundings; forces and, in DFSPH, both solves; new places.
    pub fn record_step(&self, rec: &mut Recording) {
        let (k, hot) = (&self.constants, self.hot);
        let Cells { grid: immediates, table, keys, counts, starts, order, live, .. } = self.cells;
        let Self { particles, bodies, forces, clock, colliders, .. } = *self;
        let (each, counters) = (self.groups(), live.cast());
        self.cells.record_clear(rec, k);
        rec.call(&mpm::Clock { clock, live }, k, Groups::Direct([1, 1, 1]));
        self.cells.record_sort(rec, k, particles, clock);
        let Hot {
            places, moves, warm, numbers, spots, lists, found, crowds, locals, points, flows, flown, stirs, ..
        } = hot;
        let was = particles;
        rec.call(
            &sph::Pack {
                was,
                order,
                keys,
                starts,
                counts,
                live: counters,
                places,
                moves,
                warm,
                numbers,
                spots,
                immediates,
            },
            k,
            each,
        );
        let search =
            sph::Search { spots, table, starts, counts, places, live: counters, clock, lists, found, immediates };
        rec.call(&search, k, each);
        rec.call(&sph::Density { places, lists, found, live: counters, clock, crowds, immediates }, k, each);
        let surround = sph::Surround {
            places,
            moves,
            crowds,
            bodies,
            forces,
            colliders,
            warm,
            live: counters,
            clock,
            points,
            flows,
            locals,
            immediates,
        };
        rec.call(&surround, k, each);
        let solved = self.fluid.pressure == Pressure::Dfsph;
        if solved {
            self.record_solve(rec, true);
        }
        rec.call(
            &sph::Force { points, flows, lists, crowds, locals, live: counters, clock, flown, immediates },
            k,
            each,
        );
        if let Some(viscous) = &self.viscous {
            let live = counters;
            viscous.record(rec, k, &Step { places, flown, lists, crowds, locals, live, clock, grid: immediates, each });
        }
        if solved {
            self.record_solve(rec, false);
        }
        let particles = particles.cast();
        rec.call(
            &sph::Advance {
                points,
                flows: flown,
                locals,
                numbers,
                stirs,
                live: counters,
                clock,
                particles,
                immediates,
            },
            k,
            each,
        );
    }

    /// Makes the velocities free of divergence, or such that density is at rest after the step.
    fn record_solve(&self, rec: &mut Recording, divergence: bool) {
        let Hot { places, warm, lists, crowds, locals, points, pushes, wants, stirs, lasts, .. } = self.hot;
        let (clock, live, solve, immediates) = (self.clock, self.cells.live.cast(), self.solve, self.cells.grid);
        let flows = if divergence { self.hot.flows } else { self.hot.flown };
        let k = self.constants.clone().with("DIVERGENCE", f64::from(u8::from(divergence)));
        let (least, tolerance) =
            if divergence { (1, self.fluid.divergence_error) } else { (2, self.fluid.density_error) };
        let once = Groups::Direct([1, 1, 1]);
        let judge = |opens: bool, last: bool| sph::Judge {
            solve,
            live,
            clock,
            immediates: kernels::Rule { opens: opens.into(), least, last: last.into(), tolerance },
        };
        rec.call(&judge(true, false), &k, once);
        let source =
            sph::Source { places, flows, lists, crowds, locals, warm, live, clock, points, wants, stirs, immediates };
        rec.call(&source, &k, self.groups());
        let press = sph::Press { points, lists, crowds, locals, live, clock, pushes, flows, immediates };
        let pass = Groups::Indirect(solve.erase(), std::mem::offset_of!(Solve, groups) as u64);
        let most = MOST_ITERATIONS[usize::from(divergence)];
        for turn in 1..=most {
            rec.call(&press, &k, pass);
            rec.call(
                &sph::Relax {
                    places,
                    pushes,
                    lists,
                    crowds,
                    locals,
                    wants,
                    live,
                    clock,
                    points,
                    solve,
                    lasts,
                    immediates,
                },
                &k,
                pass,
            );
            rec.call(&judge(false, turn == most), &k, once);
        }
        rec.call(&press, &k.with("LAST", 1.0), self.groups());
    }

    fn groups(&self) -> Groups {
        Groups::Indirect(self.clock.erase(), PARTICLE_GROUPS)
    }

    fn prepare(&mut self) -> Result<(), GpuError> {
        if self.batch.is_none() {
            let mut rec = Recording::new("steps");
            let solves = self.fluid.pressure == Pressure::Dfsph || self.viscous.is_some();
            let steps = if solves { 4 } else { 32 };
            for _ in 0..steps {
                self.record_step(&mut rec);
            }
            self.batch = Some(self.gpu.prepare(&rec)?);
        }
        Ok(())
    }

    /// Begins a frame of `length` seconds without running it, for whoever submits steps recorded with
    /// [`Sph::record_step`].
    ///
    /// # Errors
    /// The device's refusal.
    pub fn start_clock(&self, length: f32) -> Result<(), GpuError> {
        self.begin(length, false)
    }

    fn begin(&self, length: f32, watch: bool) -> Result<(), GpuError> {
        let clock = Clock {
            frame_start: self.time as f32,
            frame_length: length,
            dx: self.fluid.particle_size,
            courant: self.courant,
            longest: self.limits.longest,
            watch: u32::from(watch),
            wave_speed: self.limits.speed,
            force_dt: self.force_dt,
            speed_bits: self.speed.to_bits(),
            particles: self.count,
            particle_groups: [self.count.div_ceil(64), 1, 1],
            ..Default::default()
        };
        self.gpu.write(self.solve, 0, &[Solve::default()])?;
        if let Some(viscous) = &self.viscous {
            self.gpu.write(viscous.descent, 0, &[Descent::default()])?;
        }
        self.gpu.write(self.clock, 0, &[clock])
    }

    /// Sums over body `index`. A liquid's elastic energy is not counted.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn measure(&self, index: usize) -> Result<Measure, GpuError> {
        let immediates = kernels::Only { body: index as u32, count: self.count };
        let Self { particles, deformations, bodies, sums, .. } = *self;
        let mut rec = Recording::new("measure");
        let call = mpm::Measure { particles, deformations, bodies, sums, immediates };
        rec.each(&call, &self.constants, u64::from(self.count));
        self.gpu.run(&rec)?;
        Ok(Measure::of(&self.gpu.read(sums)?, self.fluid.particle_size))
    }
}

impl Solver for Sph<'_> {
    fn frame(&mut self, length: f32) -> Result<FrameStats, GpuError> {
        Sph::frame(self, length)
    }

    fn measure(&self, index: usize) -> Result<Measure, GpuError> {
        Sph::measure(self, index)
    }

    fn time(&self) -> f64 {
        self.time
    }

    fn stop_when(&mut self, asked: Arc<AtomicBool>) {
        self.stop = Some(asked);
    }

    fn particles(&self) -> Buf<Particle> {
        self.particles
    }

    fn deformations(&self) -> Buf<Deformation> {
        self.deformations
    }

    fn deterministic(&self) -> bool {
        true
    }
}

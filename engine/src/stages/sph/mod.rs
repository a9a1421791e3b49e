//! SPH of liquids over number densities (Solenthaler & Pajarola 2008), pressure by an equation of state (WCSPH) or by
//! two solves that the device ends itself (DFSPH, Bender & Koschier 2015). Records steps once and submits them until the
//! device says that the frame is done.

mod frame;
mod hot;
mod measure;
mod shift;
mod start;
mod viscous;

use std::mem::offset_of;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use physvideo_gpu::kernels::{self, Clock, Colliders, Deformation, Forces, Keep, Particle, Solve, Sums, sph};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Prepared, Recording};

use self::hot::Hot;
use self::shift::Shift;
use self::start::{constants, initial_state, slots};
use self::viscous::{Step, Viscous};
use super::cells::{self, Cells, PARTICLE_GROUPS};
use super::emit::Emitter;
use super::energy::Budget;
use super::solver::{FrameStats, Measure, Solver};
use super::source::Recycling;
use crate::fluid::{Fluid, Limits, limits};
use crate::pocket::Pockets;
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
    keep: Buf<Keep>,
    hot: Hot,
    viscous: Option<Viscous>,
    shift: Option<Shift>,
    /// Stands for the debts where nothing is shifted.
    none: Buf<kernels::Debt>,
    cells: Cells,
    constants: Constants,
    fluid: Fluid,
    limits: Limits,
    /// A body has surface tension.
    tense: bool,
    /// From when to when obstacles move, and how fast [s, m/s].
    motions: Vec<(Range<f64>, f32)>,
    pockets: Pockets,
    force_dt: f32,
    courant: f32,
    emitters: Vec<Emitter>,
    recycling: Option<Recycling>,
    /// The particles of each body in the buffer.
    ranges: Vec<Range<u64>>,
    /// Groups of 64 particles that steps work on: none that are not emitted yet.
    listed: Vec<u32>,
    /// Frames since one was taken back.
    calm: u32,
    batch: Option<Prepared<'gpu>>,
    time: f64,
    speed: f32,
    stop: Option<Arc<AtomicBool>>,
    guarded: bool,
    /// What a frame's energy is held against; absent where steps are forced, and once shorter ones did not help.
    budget: Option<Budget>,
    /// What one step of the count of work stands for [J].
    work_unit: f32,
    count: u32,
}

impl<'gpu> Sph<'gpu> {
    /// Uploads a world.
    ///
    /// # Errors
    /// The device's refusal of a buffer or a kernel.
    pub fn new(gpu: &'gpu Gpu, world: &World) -> Result<Self, GpuError> {
        let (mut particles, deformations) = initial_state(world);
        let emitters = Emitter::all(world, &mut particles, &deformations);
        let count = particles.len() as u64;
        let grid = cells::grid(world.domain, world.cell());
        let (forces, colliders) = (world.forces(), world.obstacles());
        let ends = world.bodies.iter().scan(0, |end, b| {
            *end += b.positions.len() as u64;
            Some(*end - b.positions.len() as u64..*end)
        });
        let mut sph = Self {
            gpu,
            particles: gpu.upload("run", "sph/particles", &particles)?,
            deformations: gpu.upload("run", "sph/deformations", &deformations)?,
            saved: gpu.alloc("run", "sph/saved", count)?,
            bodies: gpu.upload("run", "sph/bodies", &start::bodies(world))?,
            forces: gpu.upload("run", "sph/forces", &[forces])?,
            clock: gpu.alloc("run", "sph/clock", 1)?,
            colliders: gpu.upload("run", "sph/colliders", &[colliders])?,
            sums: gpu.alloc("run", "sph/sums", count.div_ceil(64))?,
            solve: gpu.upload("run", "sph/solve", &[Solve::default()])?,
            keep: gpu.upload("run", "sph/keep", &[start::no_lists()])?,
            hot: Hot::new(gpu, count)?,
            viscous: limits(world).implicit.then(|| Viscous::new(gpu, count)).transpose()?,
            shift: world.fluid.shifting.then(|| Shift::new(gpu, count)).transpose()?,
            none: gpu.alloc("run", "sph/no-debts", 1)?,
            cells: Cells::new(gpu, grid, count, slots(world, &grid), count.max(1) as u32)?,
            constants: constants(world),
            fluid: world.fluid,
            limits: limits(world),
            tense: world.is_tense(),
            motions: start::motions(world),
            pockets: Pockets {
                colliders: colliders.d[..colliders.count as usize].to_vec(),
                size: world.fluid.particle_size,
                domain: world.domain,
            },
            force_dt: world.force_dt.unwrap_or(0.0),
            courant: limits(world).courant,
            emitters,
            recycling: Recycling::new(gpu, world)?,
            ranges: ends.collect(),
            listed: Vec::new(),
            calm: 0,
            batch: None,
            time: 0.0,
            speed: start::fastest(world) + limits(world).speed,
            stop: None,
            guarded: world.force_dt.is_none(),
            // What shifts do to heights is work that nobody counts.
            budget: (world.force_dt.is_none() && !world.fluid.shifting).then(|| Budget::new(world)),
            work_unit: 1.0,
            count: count as u32,
        };
        sph.choose_particles()?;
        Ok(sph)
    }

    /// Tells the sort which particles there are.
    fn choose_particles(&mut self) -> Result<(), GpuError> {
        let bodies = self.ranges.iter().enumerate();
        let there = bodies.flat_map(|(i, all)| match self.emitters.iter().find(|e| e.body == i) {
            Some(emitter) => emitter.out(),
            None => vec![all.clone()],
        });
        self.listed = there.flat_map(|r| r.start as u32..r.end as u32).collect();
        self.cells.sort_only(self.gpu, &self.listed)
    }

    /// Bytes that [`Sph::new`] will allocate.
    pub fn bytes(world: &World) -> u64 {
        let particles: u64 = world.bodies.iter().map(|b| b.positions.len() as u64).sum();
        let grid = cells::grid(world.domain, world.cell());
        let each = (2 * size_of::<Particle>() + size_of::<Deformation>() + 1) as u64 + Hot::BYTES;
        let each = each + if limits(world).implicit { Viscous::BYTES } else { 0 };
        let each = each + if world.fluid.shifting { Shift::BYTES } else { 0 };
        let sort = Cells::bytes(&grid, particles, slots(world, &grid), particles.max(1) as u32);
        each * particles + sort + Recycling::bytes(world)
    }

    /// One step: sort and neighbours, where the last search does not hold any more; surroundings; forces and, in DFSPH,
    /// both solves; viscosity where it is solved for; new places.
    pub fn record_step(&self, rec: &mut Recording) {
        let (k, hot) = (&self.constants, self.hot);
        let Cells { grid: immediates, table, keys, counts, starts, order, live, .. } = self.cells;
        let Self { particles, bodies, forces, clock, colliders, .. } = *self;
        let (each, counters) = (self.groups(), live.cast());
        let keep = self.keep;
        let at = |field: usize| Groups::Indirect(keep.erase(), field as u64);
        let (searches, clears) = (at(offset_of!(Keep, groups)), at(offset_of!(Keep, clear)));
        rec.call(&sph::Clock { clock, live, keep, immediates }, k, Groups::Direct([1, 1, 1]));
        self.cells.record_clear(rec, k, clears);
        if let Some(recycling) = &self.recycling {
            recycling.record(rec, k, particles, self.deformations, clock, self.cells.awake);
        }
        self.cells.record_sort(rec, k, particles, clock, searches);
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
            searches,
        );
        let live = counters;
        let search = sph::Search { spots, table, starts, counts, places, live, clock, lists, found, keep, immediates };
        rec.call(&search, k, searches);
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
            numbers,
            debts: self.shift.map_or(self.none, |s| s.debts),
            immediates,
        };
        rec.call(&surround, k, each);
        if self.tense {
            let cohesion = sph::Cohesion {
                places,
                moves,
                lists,
                crowds,
                bodies,
                around: locals,
                live: counters,
                clock,
                locals,
                immediates,
            };
            rec.call(&cohesion, k, each);
        }
        let solved = self.fluid.pressure == Pressure::Dfsph;
        if solved {
            self.record_solve(rec, true);
        }
        rec.call(
            &sph::Force { points, flows, lists, crowds, locals, live: counters, clock, flown, immediates },
            k,
            each,
        );
        if solved {
            self.record_solve(rec, false);
        }
        // After the pressure: what gravity and pressure leave of each other is motion too, g dt of it, that a thick liquid
        // resists; before it, such a liquid sinks by that in every step.
        if let Some(viscous) = &self.viscous {
            let (live, grid, awake) = (counters, immediates, self.cells.awake);
            let step = Step { places, flown, numbers, lists, crowds, locals, live, clock, keys, awake, grid, each };
            viscous.record(rec, k, &step);
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
                bodies,
                places,
                moves,
                warm,
                keep,
                immediates,
            },
            k,
            each,
        );
        if let Some(shift) = &self.shift {
            let (live, grid) = (counters, immediates);
            let step =
                shift::Step { places, moves, lists, crowds, locals, numbers, particles, keep, live, clock, grid, each };
            shift.record(rec, k, &step);
        }
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
        let pass = Groups::Indirect(solve.erase(), offset_of!(Solve, groups) as u64);
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

    // Sums of conjugate gradients follow the particles' numbers (`sph/total`).
    fn deterministic(&self) -> bool {
        true
    }
}

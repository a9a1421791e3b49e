//! Elastic bodies on grids of their own beside the bodies of this grid: they move in the same substeps, and what is on
//! the grid and they push each other (`lagrangian/press`, `mpm/receive`). Where there are none, nothing here is compiled,
//! allocated or dispatched.

use physvideo_gpu::kernels::mpm;
use physvideo_gpu::{Buf, Gpu, GpuError, Groups, Recording};

use super::substep::RUN_GROUPS;
use super::{ASLEEP, Method, Mpm};
use crate::stages::energy::Budget;
use crate::stages::lagrangian::{self, Host, Lagrangian, LagrangianError, Shared};
use crate::stages::solver::{CALLS, FrameStats, Measure};
use crate::world::World;

/// The other solver, and what it gives to this one's nodes.
pub(super) struct Guest<'gpu> {
    /// Moves the guests.
    pub solver: Lagrangian<'gpu>,
    gifts: Buf<i32>,
    unit: f64,
}

impl<'gpu> Mpm<'gpu> {
    /// Uploads a world of which the bodies that `own` names are on grids of their own.
    ///
    /// # Errors
    /// One of those that does not qualify (see [`lagrangian::fit`]), or the device's refusal.
    pub fn beside(gpu: &'gpu Gpu, world: &World, method: Method, own: &[bool]) -> Result<Self, LagrangianError> {
        // A body at rest would have to be woken by what comes near on another grid.
        let method = Method { sleep: false, ..method };
        let mut mpm = Self::build(gpu, world, method, own)?;
        let Self { particles, deformations, bodies, clock, .. } = mpm;
        let solver = Lagrangian::beside(gpu, world, own, Host { particles, deformations, bodies, clock })?;
        let (gifts, unit) = (mpm.gifts()?, lagrangian::unit(world, own));
        mpm.guest = Some(Guest { solver, gifts, unit });
        mpm.wave_speed = world.wave_speeds().1;
        mpm.budget = mpm.budget.take().map(Budget::beside);
        mpm.show_grid();
        Ok(mpm)
    }

    /// Room for what nodes are given.
    pub(super) fn gifts(&self) -> Result<Buf<i32>, GpuError> {
        self.gpu.alloc("grid", "mpm/gifts", 3 * 64 * u64::from(self.cells.grid.capacity))
    }

    /// Takes new room for gifts, after the grid has moved.
    pub(super) fn move_guest(&mut self) -> Result<(), GpuError> {
        if self.guest.is_some() {
            let gifts = self.gifts()?;
            self.guest.iter_mut().for_each(|g| g.gifts = gifts);
            self.show_grid();
        }
        Ok(())
    }

    fn show_grid(&mut self) {
        let (grid, table, nodes) = (self.cells.grid, self.cells.table, self.nodes);
        if let Some(Guest { solver, gifts, .. }) = &mut self.guest {
            solver.share(Shared { grid, table, nodes, gifts: *gifts });
        }
    }

    /// The guests' part of a substep, once the nodes have their velocities.
    pub(super) fn record_guest(&self, rec: &mut Recording) {
        let Some(Guest { solver, gifts, unit }) = &self.guest else { return };
        let Self { clock, colliders, nodes, .. } = *self;
        let first = RUN_GROUPS + 16 * CALLS as u64;
        solver.record_beside(rec, |call| Groups::Indirect(clock.erase(), first + 16 * call as u64));
        let (list, live, table) = (self.cells.list, self.cells.live.cast(), self.cells.table);
        let receive =
            mpm::Receive { list, live, nodes, clock, colliders, table, gifts: *gifts, immediates: self.cells.grid };
        rec.call(&receive, &self.constants.clone().with("UNIT", *unit), self.cells.node_groups());
    }

    /// A frame in which nothing of this grid moves, if there are guests.
    pub(super) fn guests_alone(&mut self, length: f32) -> Result<Option<FrameStats>, GpuError> {
        let time = self.time;
        self.guest.as_mut().map(|g| g.solver.frame_alone(time, length)).transpose()
    }

    /// Sums over body `index`, if it is a guest.
    pub(super) fn measure_guest(&self, index: usize) -> Option<Result<Measure, GpuError>> {
        let is = self.guests.get(index) == Some(&true);
        self.guest.as_ref().filter(|_| is).map(|g| g.solver.measure(index))
    }
}

/// Particles of guests are no business of this grid's calls.
pub(super) fn leave_out(world: &World, guests: &[bool], particles: &mut [physvideo_gpu::kernels::Particle]) {
    let mut first = 0;
    for (body, guest) in world.bodies.iter().zip(guests) {
        let range = first..first + body.positions.len();
        first = range.end;
        if *guest {
            particles[range].iter_mut().for_each(|p| p.tag |= ASLEEP);
        }
    }
}

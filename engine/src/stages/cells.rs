//! The active blocks of the grid and the particles' order in them, rebuilt every substep by a counting sort.
//! Shared by every solver that needs to know who is near.

use physvideo_gpu::kernels::{self, Clock, Grid, Live, Particle, Row, cells};
use physvideo_gpu::{Buf, Constants, Gpu, GpuError, Groups, Recording};

/// Buffers of the sort.
#[derive(Clone, Copy, Debug)]
pub struct Cells {
    /// The grid's place and size.
    pub grid: Grid,
    /// Slot + 1 of each block, 0 where it is not active.
    pub table: Buf<u32>,
    /// Block of each slot.
    pub list: Buf<u32>,
    /// Particles in each cell of each slot.
    pub counts: Buf<u32>,
    /// First place of each cell in the order.
    pub starts: Buf<u32>,
    /// Numbers of the particles that are sorted: all, unless [`Cells::sort_only`] says otherwise.
    pub awake: Buf<u32>,
    /// Cell of each particle: block · 64 + its place in the block while the sort goes on, slot · 64 + that afterwards.
    pub keys: Buf<u32>,
    /// Place of each particle within its cell.
    pub ranks: Buf<u32>,
    /// Particles by block, then by cell.
    pub order: Buf<u32>,
    /// First place in the order and number of particles of each slot.
    pub spans: Buf<[u32; 2]>,
    /// The rows of four cells that hold particles.
    pub rows: Buf<Row>,
    /// Place of each row in `rows` + 1, 0 where it is empty.
    pub marks: Buf<u32>,
    /// Which of the sixteen rows of each slot hold particles, a bit each.
    pub fills: Buf<u32>,
    /// Slots below and above each slot, eight each, and the fills of those below.
    pub links: Buf<u32>,
    /// Counters, at the same time sizes of indirect dispatches.
    pub live: Buf<Live>,
    /// Slots there is room for.
    pub capacity: u32,
}

/// Byte offset of the workgroup count over particle blocks in `Live`.
pub const BLOCK_GROUPS: u64 = std::mem::offset_of!(Live, blocks) as u64;
/// Byte offset of the workgroup count over node blocks in `Live`.
pub const NODE_GROUPS: u64 = std::mem::offset_of!(Live, nodes) as u64;
/// Byte offset of the workgroup count over occupied rows in `Live`.
pub const ROW_GROUPS: u64 = std::mem::offset_of!(Live, row_groups) as u64;
/// Byte offset of the workgroup count over particles in `Clock`.
pub const PARTICLE_GROUPS: u64 = std::mem::offset_of!(Clock, particle_groups) as u64;

/// A grid of cells of size `dx` that covers `domain` with the margin its particles' stencils need.
pub fn grid(domain: ([f32; 3], [f32; 3]), dx: f32) -> Grid {
    let mut grid = Grid { dx, ..Default::default() };
    for axis in 0..3 {
        // Nodes at whole multiples of dx, so that a plane z = 0 is a plane of nodes.
        let low = (domain.0[axis] / dx).floor() - 4.0;
        let cells = (domain.1[axis] / dx).ceil() - low + 4.0;
        grid.origin[axis] = low * dx;
        grid.blocks[axis] = (cells / 4.0).ceil().max(2.0) as u32;
    }
    grid
}

impl Cells {
    /// Bytes that [`Cells::new`] allocates for `particles`.
    pub fn bytes(grid: &Grid, particles: u64, capacity: u32, rows: u32) -> u64 {
        let dense = grid.blocks.iter().map(|b| u64::from(*b)).product::<u64>();
        4 * (dense + (2 * 64 + 16 + 28) * u64::from(capacity) + 4 * particles)
            + size_of::<Row>() as u64 * u64::from(rows)
    }

    /// Buffers for `particles` with room for `capacity` blocks and `rows` occupied rows.
    ///
    /// # Errors
    /// The device's refusal of a buffer.
    pub fn new(gpu: &Gpu, mut grid: Grid, particles: u64, capacity: u32, rows: u32) -> Result<Self, GpuError> {
        (grid.capacity, grid.rows) = (capacity, rows);
        let dense = grid.blocks.iter().map(|b| u64::from(*b)).product::<u64>();
        let slots = u64::from(capacity);
        Ok(Self {
            grid,
            table: gpu.alloc("grid", "cells/table", dense)?,
            list: gpu.alloc("grid", "cells/list", slots)?,
            counts: gpu.alloc("grid", "cells/counts", 64 * slots)?,
            starts: gpu.alloc("grid", "cells/starts", 64 * slots)?,
            awake: gpu.upload("grid", "cells/awake", &Vec::from_iter(0..particles as u32))?,
            keys: gpu.alloc("grid", "cells/keys", particles)?,
            ranks: gpu.alloc("grid", "cells/ranks", particles)?,
            order: gpu.alloc("grid", "cells/order", particles)?,
            spans: gpu.alloc("grid", "cells/spans", slots)?,
            rows: gpu.alloc("grid", "cells/rows", u64::from(rows))?,
            marks: gpu.alloc("grid", "cells/marks", 16 * slots)?,
            links: gpu.alloc("grid", "cells/links", 24 * slots)?,
            fills: gpu.alloc("grid", "cells/fills", slots)?,
            live: gpu.alloc("grid", "cells/live", 1)?,
            capacity,
        })
    }

    /// Sorts only these particles from now on; the clock dispatches as many.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn sort_only(&self, gpu: &Gpu, particles: &[u32]) -> Result<(), GpuError> {
        gpu.write(self.awake, 0, particles)
    }

    /// Workgroups over the blocks that hold particles.
    pub fn block_groups(&self) -> Groups {
        Groups::Indirect(self.live.erase(), BLOCK_GROUPS)
    }

    /// Workgroups over the rows that hold particles.
    pub fn row_groups(&self) -> Groups {
        Groups::Indirect(self.live.erase(), ROW_GROUPS)
    }

    /// Workgroups over the blocks that hold nodes.
    pub fn node_groups(&self) -> Groups {
        Groups::Indirect(self.live.erase(), NODE_GROUPS)
    }

    /// Forgets the blocks of the last sort, of which there are `nodes`.
    pub fn record_clear(&self, rec: &mut Recording, constants: &Constants, nodes: Groups) {
        let clear = cells::Clear { list: self.list, table: self.table, counts: self.counts, immediates: self.grid };
        rec.call(&clear, constants, nodes);
    }

    /// Begins with no block, whatever was claimed for a sort that did not come.
    ///
    /// # Errors
    /// The device's refusal.
    pub fn start_anew(&self, gpu: &Gpu) -> Result<(), GpuError> {
        let Self { list, table, counts, grid: immediates, live, .. } = *self;
        let claimed = gpu.read(live)?[0].blocks.min(self.capacity);
        if claimed > 0 {
            let mut rec = Recording::new("forget");
            let clear = cells::Clear { list, table, counts, immediates };
            rec.call(&clear, &Constants::none(), Groups::Direct([claimed, 1, 1]));
            gpu.run(&rec)?;
        }
        let [blocks_y, blocks_z, nodes_y, nodes_z, row_groups_y, row_groups_z] = [1; 6];
        let none = Live { blocks_y, blocks_z, nodes_y, nodes_z, row_groups_y, row_groups_z, ..Default::default() };
        gpu.write(live, 0, &[none])
    }

    /// Sorts the particles into blocks and cells; `groups` of 64 at a time.
    pub fn record_sort(
        &self,
        rec: &mut Recording,
        constants: &Constants,
        particles: Buf<Particle>,
        clock: Buf<Clock>,
        groups: Groups,
    ) {
        self.locate_in(rec, constants, particles, clock, groups);
        self.order_in(rec, constants, clock, groups, false);
    }

    /// Finds the particles' cells and claims their blocks.
    pub fn record_locate(
        &self,
        rec: &mut Recording,
        constants: &Constants,
        particles: Buf<Particle>,
        clock: Buf<Clock>,
    ) {
        self.locate_in(rec, constants, particles, clock, Groups::Indirect(clock.erase(), PARTICLE_GROUPS));
    }

    fn locate_in(
        &self,
        rec: &mut Recording,
        constants: &Constants,
        particles: Buf<Particle>,
        clock: Buf<Clock>,
        groups: Groups,
    ) {
        let Self { grid: immediates, table, keys, list, live, awake, .. } = *self;
        let (was, claimed) = (particles, table);
        let locate = cells::Locate { particles, keys, table, list, live, immediates, clock, was, claimed, awake };
        rec.call(&locate, constants, groups);
    }

    /// Brings the particles, whose cells are known, into an order; `ticks` chooses the next substep on the way.
    pub fn record_order(&self, rec: &mut Recording, constants: &Constants, clock: Buf<Clock>, ticks: bool) {
        self.order_in(rec, constants, clock, Groups::Indirect(clock.erase(), PARTICLE_GROUPS), ticks);
    }

    fn order_in(&self, rec: &mut Recording, constants: &Constants, clock: Buf<Clock>, groups: Groups, ticks: bool) {
        let Self { grid: immediates, table, list, counts, starts, keys, ranks, order, live, .. } = *self;
        let Self { spans, rows, marks, links, fills, awake, .. } = *self;
        rec.call(&cells::Count { keys, table, counts, ranks, clock, awake, immediates }, constants, groups);
        rec.call(
            &cells::Range { counts, starts, table, list, live, spans, rows, marks, fills, clock, immediates },
            &constants.clone().with("TICKS", f64::from(u8::from(ticks))),
            self.block_groups(),
        );
        rec.call(
            &cells::Link { table, list, links, fills, live: live.cast(), immediates },
            constants,
            self.node_groups(),
        );
        let was = keys;
        rec.call(&cells::Place { was, keys, table, starts, ranks, order, clock, awake, immediates }, constants, groups);
    }
}

/// Number of blocks and of rows of four cells of a grid that a set of points touches, on the host.
pub fn touched(grid: &Grid, positions: impl Iterator<Item = [f32; 3]>) -> (u64, u64) {
    let (mut blocks, mut rows) = (std::collections::HashSet::new(), std::collections::HashSet::new());
    for x in positions {
        let cell: [i32; 3] = std::array::from_fn(|a| ((x[a] - grid.origin[a]) / grid.dx - 0.5).floor() as i32);
        blocks.insert(cell.map(|c| c.div_euclid(4)));
        rows.insert([cell[0].div_euclid(4), cell[1], cell[2]]);
    }
    (blocks.len() as u64, rows.len() as u64)
}

pub use kernels::Live as Counters;

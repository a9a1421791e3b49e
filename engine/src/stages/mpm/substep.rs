//! The calls of a substep, in their order.

use physvideo_gpu::kernels::{self, Clock, mpm};
use physvideo_gpu::{Groups, Recording};

use super::{Mpm, P2g};
use crate::stages::cells::Cells;

/// Byte offset of the workgroup counts of the runs in `Clock`.
pub(super) const RUN_GROUPS: u64 = std::mem::offset_of!(Clock, runs) as u64;

impl Mpm<'_> {
    /// One substep: the rest of the sort and the clock, P2G, grid, G2P with the begin of the next sort.
    pub fn record_substep(&self, rec: &mut Recording) {
        let k = &self.constants;
        let Cells { grid: immediates, table, keys, list, counts, order, spans, rows, marks, links, live, .. } =
            self.cells;
        let Self { particles, deformations, bodies, forces, clock, colliders, given, nodes, .. } = *self;
        // Guests look blocks up after the grid update, which otherwise ends the sort.
        let grid_constants = match &self.guest {
            Some(_) => &k.clone().with("FORGETS", 0.0),
            None => k,
        };
        let (blocks, slots, filled) = (self.cells.block_groups(), self.cells.node_groups(), self.cells.row_groups());
        let counters = live.cast();
        self.cells.record_order(rec, k, clock, true);
        match self.p2g {
            P2g::Cell => {
                let p2g = mpm::P2g {
                    particles,
                    bodies,
                    order,
                    placed: order,
                    rows,
                    counts,
                    shares: given,
                    live: counters,
                    clock,
                    forces,
                    immediates,
                };
                rec.call(&p2g, k, filled);
            }
            P2g::Fixed => {
                let tiles = given;
                rec.call(
                    &mpm::P2gFixed { particles, bodies, order, spans, tiles, clock, forces, immediates },
                    k,
                    blocks,
                );
            }
            P2g::Float => {
                let tiles = given.cast();
                rec.call(
                    &mpm::P2gFloat { particles, bodies, order, spans, tiles, clock, forces, immediates },
                    k,
                    blocks,
                );
            }
        }
        if self.p2g == P2g::Cell {
            let (shares, counts) = (given, counts.cast());
            let grid = mpm::GridRows {
                shares,
                marks,
                links,
                list,
                nodes,
                clock,
                colliders,
                table,
                counts,
                live: counters,
                immediates,
            };
            rec.call(&grid, grid_constants, slots);
        } else {
            let tiles = given;
            let grid =
                mpm::Grid { tiles, links, list, live: counters, nodes, clock, colliders, table, counts, immediates };
            rec.call(&grid, grid_constants, slots);
        }
        self.record_guest(rec);
        for (i, run) in self.runs.iter().enumerate() {
            let g2p = mpm::G2p {
                was: particles,
                particles: particles.cast(),
                deformed: deformations,
                deformations,
                bodies,
                // Found by their cells where all of the scene are of one material, else by their numbers.
                order: if self.runs.len() == 1 { order } else { self.cells.awake },
                cells: keys,
                keys,
                links,
                nodes,
                claimed: table,
                table,
                list,
                live,
                clock,
                immediates: kernels::Grid { run: i as u32, ..immediates },
            };
            rec.call(&g2p, &run.constants, Groups::Indirect(clock.erase(), RUN_GROUPS + 16 * i as u64));
        }
        if self.recycling.is_some() {
            self.record_locate(rec);
        }
    }

    /// The begin of a sort where no G2P has made it: in a frame's first substep, and after particles started anew.
    pub(super) fn record_locate(&self, rec: &mut Recording) {
        let k = &self.constants;
        let Self { particles, deformations, clock, .. } = *self;
        if let Some(recycling) = &self.recycling {
            recycling.record(rec, k, particles, deformations, clock, self.cells.awake);
        }
        self.cells.record_locate(rec, k, particles, clock);
    }
}

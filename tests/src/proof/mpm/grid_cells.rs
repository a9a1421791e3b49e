//! Proof of `mpm/grid_cells`: as `mpm/grid`, from the shares of occupied cells.

use physvideo_gpu::kernels::{Cell, Grid};

use super::grid::{self, Sums};
use crate::proof::lattice::coordinates;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "mpm/grid_cells",
    inputs,
    compare,
    tolerance: grid::CASE.tolerance,
    reason: "as mpm/grid, with sums of 27",
    unordered: &[],
    bytes: 16.0 * 28.0 + 4.0 * 27.0,
    flops: 250.0,
};

fn inputs(ask: Ask) -> Call {
    let (call, sorted) = grid::frame(ask);
    call.with("shares", &grid::gifts(ask, sorted.occupied.len() * 27))
        .with("marks", &sorted.marks)
        .with("occupied", &sorted.occupied)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (grid, list): (Grid, Vec<u32>) = (call.buffers.one("grid"), call.buffers.get("list"));
    let shares: Vec<[f32; 4]> = call.buffers.get("shares");
    let mut sums = Sums::default();
    for (cell, given) in call.buffers.get::<Cell>("occupied").iter().zip(shares.chunks(27)) {
        let block = coordinates(&grid, list[cell.id as usize / 64]);
        let local = [cell.id % 4, cell.id / 4 % 4, cell.id / 16 % 4];
        for (n, share) in given.iter().enumerate() {
            let offset = [n % 3, n / 3 % 3, n / 9];
            sums.add(std::array::from_fn(|i| i64::from(block[i] * 4 + local[i]) + offset[i] as i64), share);
        }
    }
    grid::compare_nodes(call, out, &sums)
}

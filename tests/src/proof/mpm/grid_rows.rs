//! Proof of `mpm/grid_rows`: as `mpm/grid`, from the shares of occupied rows.

use physvideo_gpu::kernels::{Grid, Row};

use super::grid::{self, Sums};
use crate::proof::lattice::coordinates;
use crate::proof::{Ask, Buffers, Call, Case, Compared};

/// Nodes that a row of four cells reaches: 6 × 3 × 3, x slowest, then z, then y.
pub(super) const SHARES: usize = 54;
/// Rows of a workgroup.
pub(crate) const ROW_LANES: usize = 8;

pub static CASE: Case = Case {
    kernel: "mpm/grid_rows",
    inputs,
    compare,
    tolerance: grid::CASE.tolerance,
    reason: "as mpm/grid, with sums of up to 18",
    unordered: &[],
    bytes: 16.0 * 14.5 + 4.0 * 4.5,
    flops: 200.0,
};

fn inputs(ask: Ask) -> Call {
    let (call, sorted) = grid::frame(ask);
    call.with("shares", &grid::gifts(ask, sorted.rows.len() * SHARES))
        .with("marks", &sorted.marks)
        .with("rows", &sorted.rows)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let (grid, list): (Grid, Vec<u32>) = (call.buffers.one("grid"), call.buffers.get("list"));
    let shares: Vec<[f32; 4]> = call.buffers.get("shares");
    let mut sums = Sums::default();
    for (row, given) in call.buffers.get::<Row>("rows").iter().zip(shares.chunks(SHARES)) {
        let block = coordinates(&grid, list[row.id as usize / 16]);
        let local = [0, row.id % 4, row.id / 4 % 4];
        for (n, share) in given.iter().enumerate() {
            let offset = [n / 9, n % 3, n / 3 % 3];
            sums.add(std::array::from_fn(|i| i64::from(block[i] * 4 + local[i]) + offset[i] as i64), share);
        }
    }
    grid::compare_nodes(call, out, &sums)
}

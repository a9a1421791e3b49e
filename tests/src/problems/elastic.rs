//! The suite of elastic solids, M1 to M8: which problems there are, and by which methods and steps they are swept.

use super::{Problem, bar, cantilever, column, discs, manufactured, motion};

/// Updated-Lagrangian MPM with the true gradient of the B-spline and with the MLS form, 8 particles a cell; the first
/// with 27.
pub const METHODS: [&str; 3] = ["updated_lagrangian", "mls", "updated_lagrangian_27"];

/// The same, and bodies on grids of their own.
pub const WITH_OWN_GRID: [&str; 4] = ["updated_lagrangian", "mls", "updated_lagrangian_27", "total_lagrangian"];

/// Shares of the step in which the fastest wave crosses a cell.
pub const COURANTS: [f32; 3] = [0.2, 0.4, 0.75];

/// The problems.
pub const PROBLEMS: [Problem; 9] = [
    motion::FALL,
    motion::SPIN,
    manufactured::CUBE,
    manufactured::BAR,
    bar::BAR,
    discs::DISCS,
    cantilever::BEAM,
    cantilever::SHORT,
    column::COLUMN,
];

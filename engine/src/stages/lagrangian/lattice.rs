//! The lattice a body's particles lie on, if they lie on one: indices of the particles, and the cells and nodes around
//! them. Knows positions and nothing of materials.

use std::collections::HashMap;

use crate::world::Body;

/// Deviation from the lattice that is taken for rounding, as a share of the spacing.
const SLACK: f64 = 0.02;

/// A place on a lattice.
pub(super) type At = [i32; 3];

/// Why a body cannot be simulated on a grid of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unfit {
    /// It has no particles.
    Empty,
    /// Its particles are not half a cell apart.
    Spacing,
    /// Its particles lie on no lattice, or two of them at one place.
    Irregular,
    /// Its particles start anew somewhere else.
    Recycled,
    /// The material is none of the elastic ones.
    Material,
}

impl std::fmt::Display for Unfit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Empty => "has no particles",
            Self::Spacing => "has other than 8 particles a cell",
            Self::Irregular => "has particles on no regular lattice",
            Self::Recycled => "is emitted or starts anew at its source",
            Self::Material => "has a material that is not elastic",
        })
    }
}

/// Particles by their place on a lattice of spacing `spacing` [m].
pub(super) struct Lattice {
    /// Place of each particle; the lowest along each axis is 0.
    pub at: Vec<At>,
    /// Position of place 0 [m].
    pub origin: [f64; 3],
    /// Half a cell [m].
    pub spacing: f64,
}

impl Lattice {
    /// Finds the lattice of a body whose cells are `dx` wide.
    ///
    /// # Errors
    /// Why there is none.
    pub fn of(body: &Body, dx: f32) -> Result<Self, Unfit> {
        let spacing = 0.5 * f64::from(dx);
        let first = body.positions.first().ok_or(Unfit::Empty)?;
        if (f64::from(body.particle_volume).cbrt() / spacing - 1.0).abs() > SLACK {
            return Err(Unfit::Spacing);
        }
        let mut at = Vec::with_capacity(body.positions.len());
        for x in &body.positions {
            let mut place = [0; 3];
            for a in 0..3 {
                let steps = (f64::from(x[a]) - f64::from(first[a])) / spacing;
                // NaN and what no index can hold are off every lattice.
                if !((steps - steps.round()).abs() <= SLACK && steps.abs() < 1e8) {
                    return Err(Unfit::Irregular);
                }
                place[a] = steps.round() as i32;
            }
            at.push(place);
        }
        let low: At = std::array::from_fn(|a| at.iter().map(|p| p[a]).min().unwrap_or(0));
        at.iter_mut().for_each(|p| (0..3).for_each(|a| p[a] -= low[a]));
        let mut sorted = at.clone();
        sorted.sort_unstable();
        if sorted.windows(2).any(|two| two[0] == two[1]) {
            return Err(Unfit::Irregular);
        }
        let origin = std::array::from_fn(|a| f64::from(first[a]) + f64::from(low[a]) * spacing);
        Ok(Self { at, origin, spacing })
    }

    /// Middle of a cell, which is where its node rests [m]: the lowest particles are a quarter of a cell above a face.
    pub fn middle(&self, cell: At) -> [f64; 3] {
        std::array::from_fn(|a| self.origin[a] + (2.0 * f64::from(cell[a]) + 0.5) * self.spacing)
    }
}

/// Cell of a place, and which of its corners that is.
pub(super) fn cell(at: At) -> (At, u32) {
    let corner = (0..3).map(|a| ((at[a] & 1) as u32) << a).sum();
    (at.map(|c| c >> 1), corner)
}

/// `at` moved by `by`.
pub(super) fn moved(at: At, by: At) -> At {
    std::array::from_fn(|a| at[a] + by[a])
}

/// The 27 steps from −1 to 1, x fastest.
pub(super) fn around() -> impl Iterator<Item = At> {
    (0..27).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1])
}

/// Numbers of sorted places, z slowest and x fastest.
pub(super) struct Numbered {
    /// The places in order.
    pub list: Vec<At>,
    index: HashMap<At, u32>,
}

impl Numbered {
    /// Sorts places and numbers them from 0.
    pub fn new(places: impl Iterator<Item = At>) -> Self {
        let mut list: Vec<At> = places.collect();
        list.sort_unstable_by_key(|p| [p[2], p[1], p[0]]);
        list.dedup();
        let index = list.iter().zip(0..).map(|(p, i)| (*p, i)).collect();
        Self { list, index }
    }

    /// Number of a place.
    pub fn of(&self, at: At) -> Option<u32> {
        self.index.get(&at).copied()
    }
}

/// Weight of the node `steps` cells from the cell, at its lower (false) or upper quarter along an axis.
pub(super) fn weight(steps: i32, upper: bool) -> f64 {
    match if upper { steps } else { -steps } {
        -1 => 0.03125,
        0 => 0.6875,
        1 => 0.28125,
        _ => 0.0,
    }
}

/// Weight of a node `steps` cells from a cell at `place` cells from its middle: quadratic B-splines.
pub(super) fn weight_at(steps: At, place: [f64; 3]) -> f64 {
    let spline = |x: f64| if x.abs() < 0.5 { 0.75 - x * x } else { 0.5 * (1.5 - x.abs()).max(0.0).powi(2) };
    (0..3).map(|a| spline(place[a] - f64::from(steps[a]))).product()
}

/// Weight of a node at a corner of a cell.
pub(super) fn weight3(steps: At, corner: u32) -> f64 {
    (0..3).map(|a| weight(steps[a], corner >> a & 1 == 1)).product()
}

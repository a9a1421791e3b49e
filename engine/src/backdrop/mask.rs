//! Boolean masks over an image: growing them, distance inside them. Knows nothing of colours.

use super::FillError;

/// A row-major grid size [px].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Size {
    pub w: usize,
    pub h: usize,
}

impl Size {
    pub fn area(self) -> usize {
        self.w * self.h
    }

    /// Column and row of a flat index.
    pub fn xy(self, i: usize) -> (usize, usize) {
        (i % self.w, i / self.w)
    }
}

/// Grows `mask` (row-major, `width` × `height`) by a disk of `radius` pixels: a pixel is set when some set pixel
/// lies within Euclidean distance `radius`.
///
/// # Errors
/// [`FillError::Size`] when the mask does not have `width` · `height` entries.
pub fn dilate(width: u32, height: u32, mask: &[bool], radius: u32) -> Result<Vec<bool>, FillError> {
    let size = super::checked_size(width, height)?;
    super::check_len("mask", size, mask.len())?;
    let r = (radius as usize).min(size.w + size.h);
    let reach = (r as u64).pow(2);
    // Horizontal distance to the nearest set pixel of the same row; far = none within the row.
    let far = size.w + size.h + 1;
    let mut run = vec![far; size.area()];
    for (row, out) in mask.chunks_exact(size.w).zip(run.chunks_exact_mut(size.w)) {
        let mut since = far;
        for (&m, o) in row.iter().zip(out.iter_mut()) {
            since = if m { 0 } else { (since + 1).min(far) };
            *o = since;
        }
        let mut since = far;
        for (&m, o) in row.iter().zip(out.iter_mut()).rev() {
            since = if m { 0 } else { (since + 1).min(far) };
            *o = since.min(*o);
        }
    }
    let near = |i: usize| {
        let (x, y) = size.xy(i);
        let (top, bottom) = (y.saturating_sub(r), (y + r).min(size.h - 1));
        (top..=bottom).any(|v| {
            let (dx, dy) = (run[v * size.w + x] as u64, y.abs_diff(v) as u64);
            dx * dx + dy * dy <= reach
        })
    };
    Ok((0..size.area()).map(near).collect())
}

/// Closes slits and windows of up to about 2 · `radius` pixels in `mask`: grown by a disk of `radius`, then shrunk by it.
/// What shows through them is more often the object's own rim than background worth keeping.
///
/// # Errors
/// As [`dilate`].
pub fn close(width: u32, height: u32, mask: &[bool], radius: u32) -> Result<Vec<bool>, FillError> {
    let outside: Vec<bool> = dilate(width, height, mask, radius)?.iter().map(|&m| !m).collect();
    Ok(dilate(width, height, &outside, radius)?.iter().map(|&m| !m).collect())
}

/// Distance [px, chessboard] of every masked pixel from the nearest pixel outside the mask; 0 outside. The image
/// border does not count as outside: nothing is known there.
pub(super) fn depth_inside(size: Size, mask: &[bool]) -> Vec<u32> {
    let far = (size.w + size.h) as u32;
    let mut d: Vec<u32> = mask.iter().map(|&m| if m { far } else { 0 }).collect();
    let mut relax = |i: usize, forward: bool| {
        if d[i] == 0 {
            return;
        }
        let (x, y) = size.xy(i);
        let mut best = d[i];
        let mut see = |j: usize| best = best.min(d[j] + 1);
        let (left, right) = (x.saturating_sub(1), (x + 1).min(size.w - 1));
        if forward {
            if y > 0 {
                (left..=right).for_each(|u| see((y - 1) * size.w + u));
            }
            see(y * size.w + left);
        } else {
            if y + 1 < size.h {
                (left..=right).for_each(|u| see((y + 1) * size.w + u));
            }
            see(y * size.w + right);
        }
        d[i] = best;
    };
    (0..size.area()).for_each(|i| relax(i, true));
    (0..size.area()).rev().for_each(|i| relax(i, false));
    d
}

/// Centres of (2r+1)² squares that lie inside the image and hold only set pixels.
pub(super) fn whole_squares(size: Size, set: &[bool], r: usize) -> Vec<bool> {
    squares(size, set, r, |count, full| count == full)
}

/// Centres of (2r+1)² squares that lie inside the image and hold at least one set pixel.
pub(super) fn touching_squares(size: Size, set: &[bool], r: usize) -> Vec<bool> {
    squares(size, set, r, |count, _| count > 0)
}

fn squares(size: Size, set: &[bool], r: usize, keep: impl Fn(u32, u32) -> bool) -> Vec<bool> {
    let (w, h) = (size.w, size.h);
    // Summed-area table with an empty first row and column.
    let mut sum = vec![0u32; (w + 1) * (h + 1)];
    for y in 0..h {
        let mut row = 0;
        for x in 0..w {
            row += u32::from(set[y * w + x]);
            sum[(y + 1) * (w + 1) + x + 1] = sum[y * (w + 1) + x + 1] + row;
        }
    }
    let side = 2 * r + 1;
    let full = (side * side) as u32;
    let mut out = vec![false; size.area()];
    if w < side || h < side {
        return out;
    }
    for y in 0..=h - side {
        for x in 0..=w - side {
            let at = |u: usize, v: usize| sum[v * (w + 1) + u];
            let count = at(x + side, y + side) + at(x, y) - at(x + side, y) - at(x, y + side);
            out[(y + r) * w + x + r] = keep(count, full);
        }
    }
    out
}

//! The visible surfaces of the objects: depth per pixel, and which pixels belong together. Must not know how depth
//! was measured.

use super::complete::neighbours;
use super::unproject::Pinhole;

/// Smooth depth of the objects with the links between pixels of one surface. Row-major, width × height.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceMap {
    pub width: u32,
    pub height: u32,
    pub camera: Pinhole,
    /// Object labels; 0 for background and for labels that were not asked for.
    pub labels: Vec<u8>,
    /// Depth along the view axis [m]; known at every labelled pixel, 0 elsewhere.
    pub depth: Vec<f32>,
    /// Bit 0: same surface as the pixel to the right; bit 1: same surface as the pixel below.
    pub links: Vec<u8>,
}

pub(super) const RIGHT: u8 = 1;
pub(super) const DOWN: u8 = 2;

impl SurfaceMap {
    /// Whether two pixels that touch (sharing a side) lie on one surface.
    pub fn linked(&self, a: usize, b: usize) -> bool {
        let (first, second) = (a.min(b), a.max(b));
        let bit = if second - first == self.width as usize { DOWN } else { RIGHT };
        self.links[first] & bit != 0
    }

    /// The pixels that touch `k` on its surface.
    pub fn surface_neighbours(&self, k: usize) -> impl Iterator<Item = usize> + '_ {
        neighbours(k, self.width as usize, self.height as usize).filter(move |&n| self.linked(k, n))
    }

    /// Pixel centre of index `k` [px].
    pub fn pixel_center(&self, k: usize) -> [f32; 2] {
        let w = self.width as usize;
        [(k % w) as f32 + 0.5, (k / w) as f32 + 0.5]
    }

    /// A quantity of the pixels at an image position, linear between the pixel centres of the surface that the
    /// pixel under the position belongs to. `None` outside the picture and outside the objects.
    pub fn sample(&self, values: &[f32], at: [f32; 2]) -> Option<f32> {
        let (w, h) = (self.width as usize, self.height as usize);
        if !(at[0] >= 0.0 && at[1] >= 0.0 && at[0] < w as f32 && at[1] < h as f32) {
            return None;
        }
        let (i, j) = (at[0] as usize, at[1] as usize);
        let k = j * w + i;
        if self.labels[k] == 0 {
            return None;
        }
        let (fx, fy) = (at[0] - (i as f32 + 0.5), at[1] - (j as f32 + 0.5));
        let side = |f: f32, step: usize, low: bool, high: bool| {
            let n = if f < 0.0 { low.then(|| k - step) } else { high.then(|| k + step) };
            n.filter(|&n| self.linked(k, n))
        };
        let x = side(fx, 1, i > 0, i + 1 < w);
        let y = side(fy, w, j > 0, j + 1 < h);
        // The corner belongs to the surface when one of the two sides leads to it.
        let corner = match (x, y) {
            (Some(x), Some(y)) => {
                let c = x + y - k;
                (self.linked(x, c) || self.linked(y, c)).then_some(c)
            }
            _ => None,
        };
        let here = values[k];
        let (ax, ay) = (fx.abs(), fy.abs());
        let (vx, vy) = (x.map_or(here, |n| values[n]), y.map_or(here, |n| values[n]));
        // Without a corner the plane through the three others continues.
        let vc = corner.map_or(vx + vy - here, |n| values[n]);
        Some((1.0 - ay) * ((1.0 - ax) * here + ax * vx) + ay * ((1.0 - ax) * vy + ax * vc))
    }
}

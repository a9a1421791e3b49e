//! A photograph with labels and depth as arrays, and its resampling to the working resolution. Must not know files
//! or objects.

use super::error::{GeometryError, positive};
use super::unproject::Pinhole;

/// A photograph with what was measured of it. Arrays are row-major, top row first, width × height long.
#[derive(Debug, Clone, PartialEq)]
pub struct PhotoData {
    pub width: u32,
    pub height: u32,
    /// sRGB-encoded colour.
    pub rgb: Vec<[u8; 3]>,
    /// Object labels; 0 is background.
    pub labels: Vec<u8>,
    /// Depth along the view axis [m]; 0 is unknown.
    pub depth: Vec<f32>,
    /// Focal length [px].
    pub focal_px: f32,
    /// Principal point [px]; the centre of pixel (i, j) is at (i + 0.5, j + 0.5).
    pub principal: [f32; 2],
}

/// Two depths of one footprint closer than this fraction belong to one surface and may be averaged.
const SAME_SURFACE: f32 = 0.01;

impl PhotoData {
    /// Checks sizes and camera, and turns depths that are not positive finite numbers into unknown (0).
    ///
    /// # Errors
    /// [`GeometryError::SizeMismatch`] and [`GeometryError::NotPositive`].
    pub fn check(&mut self) -> Result<(), GeometryError> {
        self.check_sizes()?;
        positive("focal_px", f64::from(self.focal_px))?;
        if !self.principal.iter().all(|p| p.is_finite()) {
            return Err(GeometryError::NotPositive { what: "principal_px", value: f64::NAN });
        }
        for z in &mut self.depth {
            if !z.is_finite() || *z < 0.0 {
                *z = 0.0;
            }
        }
        Ok(())
    }

    /// Every array has width × height entries, and there are some.
    pub(super) fn check_sizes(&self) -> Result<(), GeometryError> {
        positive("the photograph's width", f64::from(self.width))?;
        positive("the photograph's height", f64::from(self.height))?;
        let pixels = self.width as usize * self.height as usize;
        for (what, got) in
            [("the image", self.rgb.len()), ("the label image", self.labels.len()), ("the depth map", self.depth.len())]
        {
            if got != pixels {
                return Err(GeometryError::SizeMismatch { what, width: self.width, height: self.height, got });
            }
        }
        Ok(())
    }

    /// The camera that took it.
    pub fn camera(&self) -> Pinhole {
        Pinhole { focal_px: self.focal_px, principal: self.principal }
    }

    /// The photograph at `width` pixels: square pixels of one scale in both directions, height rounded to even and
    /// the window centred, so that at most one row of the result is cut or repeated. Colour is the box average of
    /// the encoded values, the label the one covering most of the footprint (at a tie the larger, so that thin
    /// parts of objects stay), depth the median of the known depths of that label.
    ///
    /// # Errors
    /// [`GeometryError::NotPositive`] for a zero width, and those of [`PhotoData::check`].
    pub fn resample(&self, width: u32) -> Result<PhotoData, GeometryError> {
        positive("the working width", f64::from(width))?;
        let mut source = self.clone();
        source.check()?;
        let scale = f64::from(self.width) / f64::from(width);
        let height = (2.0 * (f64::from(self.height) / scale / 2.0).round()).max(2.0) as u32;
        let top = (f64::from(self.height) - f64::from(height) * scale) / 2.0;

        let columns: Vec<_> = (0..width).map(|i| footprint(f64::from(i) * scale, scale, self.width)).collect();
        let rows: Vec<_> = (0..height).map(|j| footprint(top + f64::from(j) * scale, scale, self.height)).collect();
        let pixels = width as usize * height as usize;
        let mut out = PhotoData {
            width,
            height,
            rgb: Vec::with_capacity(pixels),
            labels: Vec::with_capacity(pixels),
            depth: Vec::with_capacity(pixels),
            focal_px: (f64::from(self.focal_px) / scale) as f32,
            principal: [
                (f64::from(self.principal[0]) / scale) as f32,
                ((f64::from(self.principal[1]) - top) / scale) as f32,
            ],
        };
        let mut depths = Vec::new();
        for row in &rows {
            for column in &columns {
                let (rgb, label) = source.average(column, row);
                depths.clear();
                for (index, _) in cells(column, row, self.width) {
                    if source.labels[index] == label && source.depth[index] > 0.0 {
                        depths.push(source.depth[index]);
                    }
                }
                out.rgb.push(rgb);
                out.labels.push(label);
                out.depth.push(median(&mut depths));
            }
        }
        Ok(out)
    }

    fn average(&self, column: &[(u32, f64)], row: &[(u32, f64)]) -> ([u8; 3], u8) {
        let mut sum = [0.0; 3];
        let mut area = 0.0;
        // Few labels meet in one footprint: a list beats a table of 256.
        let mut votes: Vec<(u8, f64)> = Vec::new();
        for (index, weight) in cells(column, row, self.width) {
            area += weight;
            for (s, c) in sum.iter_mut().zip(self.rgb[index]) {
                *s += weight * f64::from(c);
            }
            match votes.iter_mut().find(|v| v.0 == self.labels[index]) {
                Some(vote) => vote.1 += weight,
                None => votes.push((self.labels[index], weight)),
            }
        }
        // A tie is a tie in spite of rounding: compare with a millionth of the footprint to spare.
        let most = votes.iter().fold(0.0, |m: f64, v| m.max(v.1)) - 1e-6 * area;
        let label = votes.iter().filter(|v| v.1 >= most).map(|v| v.0).max().unwrap_or(0);
        (sum.map(|s| (s / area).round() as u8), label)
    }
}

/// The source pixels under [start, start + length) and how much of each is covered [px].
fn footprint(start: f64, length: f64, limit: u32) -> Vec<(u32, f64)> {
    let last = f64::from(limit) - 1.0;
    let (lo, hi) = (start.max(0.0), (start + length).min(f64::from(limit)));
    let covered: Vec<_> = (lo.floor().max(0.0) as u32..=hi.ceil().min(last) as u32)
        .map(|p| (p, hi.min(f64::from(p) + 1.0) - lo.max(f64::from(p))))
        .filter(|c| c.1 > 1e-9)
        .collect();
    // A footprint wholly outside (a very flat photograph made even) repeats the border.
    if covered.is_empty() { vec![((start.clamp(0.0, last)) as u32, 1.0)] } else { covered }
}

fn cells<'a>(column: &'a [(u32, f64)], row: &'a [(u32, f64)], width: u32) -> impl Iterator<Item = (usize, f64)> + 'a {
    row.iter().flat_map(move |&(y, wy)| {
        column.iter().map(move |&(x, wx)| (y as usize * width as usize + x as usize, wx * wy))
    })
}

/// Median; the mean of the middle two only when they lie on one surface, else the nearer, never a point in between.
fn median(values: &mut [f32]) -> f32 {
    if values.is_empty() {
        return 0.0;
    }
    values.sort_by(f32::total_cmp);
    let (low, high) = (values[(values.len() - 1) / 2], values[values.len() / 2]);
    if high - low < SAME_SURFACE * low { 0.5 * (low + high) } else { low }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn photo(width: u32, height: u32) -> PhotoData {
        let n = (width * height) as usize;
        PhotoData {
            width,
            height,
            rgb: vec![[10, 20, 30]; n],
            labels: vec![0; n],
            depth: vec![1.0; n],
            focal_px: 100.0,
            principal: [width as f32 / 2.0, height as f32 / 2.0],
        }
    }

    #[test]
    fn same_width_changes_nothing() {
        let mut p = photo(6, 4);
        p.rgb[7] = [200, 1, 9];
        p.labels[3] = 5;
        p.depth[2] = 3.0;
        assert_eq!(p.resample(6).unwrap(), p);
    }

    #[test]
    fn halving_averages_colour_and_votes_on_labels() {
        let mut p = photo(4, 4);
        for (i, v) in [(0, 0), (1, 100), (4, 100), (5, 200)] {
            p.rgb[i] = [v, v, v];
        }
        // Three of four pixels are object 1; their depths are 2, 2, unknown; the background's 1 must not count.
        for i in [0, 1, 4] {
            p.labels[i] = 1;
            p.depth[i] = 2.0;
        }
        p.depth[4] = 0.0;
        // A tie goes to the object.
        p.labels[2] = 1;
        p.labels[3] = 1;
        let q = p.resample(2).unwrap();
        assert_eq!((q.width, q.height), (2, 2));
        assert_eq!(q.rgb[0], [100, 100, 100]);
        assert_eq!((q.labels[0], q.depth[0]), (1, 2.0));
        assert_eq!(q.labels[1], 1);
        assert_eq!((q.focal_px, q.principal), (50.0, [1.0, 1.0]));
    }

    #[test]
    fn median_never_invents_a_depth_between_surfaces() {
        assert_eq!(median(&mut [1.0, 1.5, 1.0, 1.5]), 1.0);
        assert!((median(&mut [1.0, 1.004]) - 1.002).abs() < 1e-6);
    }

    #[test]
    fn a_ratio_that_is_not_whole_keeps_rays_where_they_were() {
        // The size of the aloe. A ramp in x and y must come out as the same ramp at the same viewing rays.
        let (w, h) = (1282, 1110);
        let mut p = photo(w, h);
        for j in 0..h {
            for i in 0..w {
                let k = (j * w + i) as usize;
                p.rgb[k] = [(i * 255 / w) as u8, (j * 255 / h) as u8, 0];
                p.depth[k] = 1.0 + 1e-3 * (i as f32 + 0.5) / 1.282;
            }
        }
        let q = p.resample(640).unwrap();
        assert_eq!((q.width, q.height), (640, 554));
        let (full, small) = (p.camera(), q.camera());
        for (i, j) in [(0, 0), (639, 553), (320, 277), (17, 400)] {
            let ray = small.unproject([i as f32 + 0.5, j as f32 + 0.5], 1.0);
            let ([u, v], _) = full.project(ray).unwrap();
            let k = (j * 640 + i) as usize;
            // Encoded colour is quantised to 1 and the average rounds: 1.5 of 255 at most.
            assert!((f32::from(q.rgb[k][0]) + 0.5 - u * 255.0 / w as f32).abs() < 1.5);
            assert!((f32::from(q.rgb[k][1]) + 0.5 - v * 255.0 / h as f32).abs() < 1.5);
            // A median of 2 or 3 columns may sit half a column off: 0.5 · 7.8e-4.
            assert!((q.depth[k] - (1.0 + 1e-3 * u / 1.282)).abs() < 5e-4, "{} {u}", q.depth[k]);
        }
    }

    #[test]
    fn bad_sizes_and_cameras_are_named() {
        let mut p = photo(4, 4);
        p.labels.pop();
        let text = p.resample(2).unwrap_err().to_string();
        assert_eq!(
            text,
            "the label image has 15 pixels but the photograph is 4×4; all images of a photo must be the same size"
        );
        assert!(photo(4, 4).resample(0).is_err());
        let mut p = photo(4, 4);
        p.focal_px = f32::NAN;
        assert!(matches!(p.check(), Err(GeometryError::NotPositive { what: "focal_px", .. })));
        let mut p = photo(4, 4);
        p.depth[0] = f32::NAN;
        p.depth[1] = -2.0;
        p.check().unwrap();
        assert_eq!(p.depth[..3], [0.0, 0.0, 1.0]);
    }
}

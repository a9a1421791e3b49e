//! How thick the body behind each pixel of a mask is. Must not know particles.

use super::surface::SurfaceMap;
use crate::scene::Thickness;

/// Thickness [m] along the view ray at every pixel of `label`; 0 elsewhere.
///
/// *Extrude* is one number. *Inflate* rounds the body's cross-section: with d the distance of a pixel to the
/// silhouette and R the radius of the largest disk that fits into the silhouette and covers the pixel (the *local
/// thickness* of Hildebrand and Rüegsegger 1997), both in metres, the ridge (d = R) has thickness
/// T = clamp(2 · scale · R, min, max) and the section is the ellipse T · √(u (2 − u)), u = d / R, nowhere below
/// min. With scale 1 and no clamping a strip becomes a round rod and a disk a ball.
pub fn thickness(map: &SurfaceMap, label: u8, rule: Thickness) -> Vec<f32> {
    let mut thick: Vec<f32> = match rule {
        Thickness::Extrude(thickness) => {
            return map.labels.iter().map(|&l| if l == label && l != 0 { thickness } else { 0.0 }).collect();
        }
        Thickness::Inflate { scale, min, max } => {
            let distance = silhouette_distance(map, label);
            let radius = covering_radius(&distance, map.width as usize);
            (0..distance.len())
                .map(|k| {
                    if map.labels[k] != label || label == 0 {
                        return 0.0;
                    }
                    if !distance[k].is_finite() {
                        return max;
                    }
                    let metres = map.depth[k] / map.camera.focal_px;
                    // Not `clamp`: it panics when a scene gives min above max; then max wins.
                    let ridge = (2.0 * scale * radius[k] * metres).max(min).min(max);
                    let u = (distance[k] / radius[k]).min(1.0);
                    (ridge * (u * (2.0 - u)).sqrt()).max(min).min(max)
                })
                .collect()
        }
    };
    // The covering radius jumps where two disks meet; averages along the surface hide the seam.
    let inside: Vec<usize> = (0..thick.len()).filter(|&k| thick[k] > 0.0).collect();
    for _ in 0..6 {
        let before = thick.clone();
        for &k in &inside {
            let (sum, count) =
                map.surface_neighbours(k).fold((before[k], 1.0), |(sum, count), n| (sum + before[n], count + 1.0));
            thick[k] = sum / count;
        }
    }
    thick
}

/// Distance [px] from each pixel centre of `label` to the nearest silhouette: the sides of pixels where the label
/// ends or the surface jumps in depth. The frame of the picture is no silhouette, because what it cuts goes on
/// behind it. 0 outside the label, infinite when there is no silhouette at all.
pub fn silhouette_distance(map: &SurfaceMap, label: u8) -> Vec<f32> {
    let (w, h) = (map.width as usize, map.height as usize);
    let is = |k: usize| map.labels[k] == label && label != 0;
    // Pixel centres at odd places of a grid twice as fine, the middles of their sides between them.
    let (fw, fh) = (2 * w + 1, 2 * h + 1);
    let mut grid = vec![f32::INFINITY; fw * fh];
    for k in 0..w * h {
        let (i, j) = (k % w, k / w);
        let right = (i + 1 < w).then_some((k + 1, (2 * j + 1) * fw + 2 * i + 2));
        let down = (j + 1 < h).then_some((k + w, (2 * j + 2) * fw + 2 * i + 1));
        for (n, side) in [right, down].into_iter().flatten() {
            if (is(k) || is(n)) && !(is(k) && is(n) && map.linked(k, n)) {
                grid[side] = 0.0;
            }
        }
    }
    squared_distance(&mut grid, fw, fh);
    (0..w * h).map(|k| if is(k) { 0.5 * grid[(2 * (k / w) + 1) * fw + 2 * (k % w) + 1].sqrt() } else { 0.0 }).collect()
}

/// Exact squared Euclidean distance to the zeros of `grid`, in place (Felzenszwalb and Huttenlocher 2012).
fn squared_distance(grid: &mut [f32], width: usize, height: usize) {
    let mut line = vec![0.0; width.max(height)];
    let mut scratch = Envelope::default();
    for i in 0..width {
        for j in 0..height {
            line[j] = grid[j * width + i];
        }
        scratch.transform(&mut line[..height]);
        for j in 0..height {
            grid[j * width + i] = line[j];
        }
    }
    for row in grid.chunks_mut(width) {
        scratch.transform(row);
    }
}

/// Lower envelope of the parabolas rooted at a line's finite values.
#[derive(Default)]
struct Envelope {
    roots: Vec<(usize, f32)>,
    /// Where the parabola of the same index begins to be lowest.
    starts: Vec<f64>,
}

impl Envelope {
    fn transform(&mut self, line: &mut [f32]) {
        self.roots.clear();
        self.starts.clear();
        for (q, &value) in line.iter().enumerate() {
            if !value.is_finite() {
                continue;
            }
            let mut start = f64::NEG_INFINITY;
            while let (Some(&(p, low)), Some(&from)) = (self.roots.last(), self.starts.last()) {
                let (x, y) = (q as f64, p as f64);
                start = (f64::from(value) + x * x - f64::from(low) - y * y) / (2.0 * (x - y));
                if start > from {
                    break;
                }
                self.roots.pop();
                self.starts.pop();
                start = f64::NEG_INFINITY;
            }
            self.roots.push((q, value));
            self.starts.push(start);
        }
        if self.roots.is_empty() {
            return;
        }
        let mut k = 0;
        for (q, value) in line.iter_mut().enumerate() {
            while k + 1 < self.roots.len() && self.starts[k + 1] < q as f64 {
                k += 1;
            }
            let (root, base) = self.roots[k];
            let d = q as f32 - root as f32;
            *value = d * d + base;
        }
    }
}

/// Radius [px] of the largest disk inside the silhouette that covers each pixel, at least the pixel's own distance.
fn covering_radius(distance: &[f32], width: usize) -> Vec<f32> {
    let height = distance.len() / width;
    let mut radius = distance.to_vec();
    // A disk whose neighbour's disk contains it adds nothing. The 0.05 px keeps the ridge on diagonal strips.
    let is_ridge = |k: usize| {
        let (x, y, d) = ((k % width) as isize, (k / width) as isize, distance[k]);
        (-1..=1).all(|dy: isize| {
            (-1..=1).all(|dx: isize| {
                let (nx, ny) = (x + dx, y + dy);
                if (dx, dy) == (0, 0) || nx < 0 || ny < 0 || nx as usize >= width || ny as usize >= height {
                    return true;
                }
                distance[ny as usize * width + nx as usize] - d < ((dx * dx + dy * dy) as f32).sqrt() - 0.05
            })
        })
    };
    for (k, &r) in distance.iter().enumerate() {
        if r <= 1.0 || !r.is_finite() || !is_ridge(k) {
            continue;
        }
        let (cx, cy) = ((k % width) as f32, (k / width) as f32);
        let (top, bottom) = ((cy - r).max(0.0) as usize, ((cy + r) as usize).min(height - 1));
        for y in top..=bottom {
            let dy = y as f32 - cy;
            let half = (r * r - dy * dy).max(0.0).sqrt();
            let (left, right) = ((cx - half).max(0.0).ceil() as usize, ((cx + half) as usize).min(width - 1));
            for value in &mut radius[y * width + left..=y * width + right] {
                if *value > 0.0 && *value < r {
                    *value = r;
                }
            }
        }
    }
    radius
}

#[cfg(test)]
mod tests {
    use super::super::unproject::Pinhole;
    use super::*;

    /// One surface at 1 m seen with 1,000 px focal length (a pixel is 1 mm), except for the given cracks.
    fn map(width: u32, height: u32, label: impl Fn(usize, usize) -> u8, cut_right_of: Option<usize>) -> SurfaceMap {
        let w = width as usize;
        let labels: Vec<u8> = (0..w * height as usize).map(|k| label(k % w, k / w)).collect();
        let links = (0..labels.len())
            .map(|k| {
                let right = k % w + 1 < w && labels[k] == labels[k + 1] && Some(k % w) != cut_right_of;
                let down = k + w < labels.len() && labels[k] == labels[k + w];
                u8::from(right) + 2 * u8::from(down)
            })
            .collect();
        let depth = labels.iter().map(|&l| if l > 0 { 1.0 } else { 0.0 }).collect();
        let camera = Pinhole { focal_px: 1000.0, principal: [0.0, 0.0] };
        SurfaceMap { width, height, camera, labels, depth, links }
    }

    #[test]
    fn distances_are_exact() {
        let m = map(23, 17, |x, y| u8::from((x * 7 + y * 5) % 11 != 0), None);
        let got = silhouette_distance(&m, 1);
        for k in 0..got.len() {
            let (x, y) = ((k % 23) as f32, (k / 23) as f32);
            let mut best = f32::INFINITY;
            for n in (0..got.len()).filter(|&n| m.labels[n] == 0) {
                let (a, b) = ((n % 23) as f32, (n / 23) as f32);
                for (sx, sy) in [(0.5, 0.0), (-0.5, 0.0), (0.0, 0.5), (0.0, -0.5)] {
                    let (px, py) = (a + sx, b + sy);
                    // Sides on the frame, and sides between two background pixels, are no silhouette.
                    let (ox, oy) = (a + 2.0 * sx, b + 2.0 * sy);
                    let inside = (0.0..23.0).contains(&ox) && (0.0..17.0).contains(&oy);
                    if inside && m.labels[oy as usize * 23 + ox as usize] == 1 {
                        best = best.min((px - x).hypot(py - y));
                    }
                }
            }
            let want = if m.labels[k] == 1 { best } else { 0.0 };
            assert!((got[k] - want).abs() < 1e-5, "pixel {k}: {} {want}", got[k]);
        }
    }

    #[test]
    fn the_frame_is_no_silhouette_and_a_depth_edge_is() {
        let m = map(40, 20, |_, _| 1, None);
        assert!(silhouette_distance(&m, 1).iter().all(|d| d.is_infinite()));
        assert!(thickness(&m, 1, Thickness::Inflate { scale: 1.0, min: 0.001, max: 0.01 }).iter().all(|&t| t == 0.01));
        let m = map(40, 20, |_, _| 1, Some(9));
        let d = silhouette_distance(&m, 1);
        assert_eq!((d[9], d[10], d[0], d[39]), (0.5, 0.5, 9.5, 29.5));
    }

    #[test]
    fn a_strip_becomes_a_round_rod() {
        // 20 px = 20 mm wide, running out of the picture on both sides.
        let m = map(80, 60, |_, y| u8::from((20..40).contains(&y)), None);
        let t = thickness(&m, 1, Thickness::Inflate { scale: 1.0, min: 0.0, max: 0.5 });
        for y in 22..38 {
            let from_axis = y as f32 + 0.5 - 30.0;
            let round = 2.0 * (100.0 - from_axis * from_axis).max(0.0).sqrt() * 1e-3;
            // Pixels see R to half a pixel, and the averages cut the sharp rim: under a millimetre and a half.
            assert!((t[y * 80 + 40] - round).abs() < 1.5e-3, "row {y}: {} {round}", t[y * 80 + 40]);
        }
        assert_eq!(t[10 * 80 + 40], 0.0);
    }

    #[test]
    fn thickness_keeps_its_bounds_and_the_middle_is_thickest() {
        let disk = |x: usize, y: usize| u8::from((x as f32 - 50.0).hypot(y as f32 - 50.0) < 30.0);
        let m = map(101, 101, disk, None);
        let t = thickness(&m, 1, Thickness::Inflate { scale: 1.0, min: 0.006, max: 0.014 });
        for (&t, &label) in t.iter().zip(&m.labels) {
            if label == 1 {
                assert!((0.006..=0.014).contains(&t), "{t}");
            } else {
                assert_eq!(t, 0.0);
            }
        }
        assert!(t[50 * 101 + 50] > 0.0139 && t[50 * 101 + 22] < 0.009);
        assert_eq!(thickness(&m, 1, Thickness::Extrude(0.02))[50 * 101 + 50], 0.02);
        // A scene with min above max must not panic.
        assert!(thickness(&m, 1, Thickness::Inflate { scale: 1.0, min: 0.1, max: 0.05 })[5100] <= 0.0501);
    }
}

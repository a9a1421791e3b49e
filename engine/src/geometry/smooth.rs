//! Depth of the objects, completed and freed of quantisation, surface by surface. Must not know thickness or volume.

use super::complete::complete;
use super::error::{GeometryError, positive};
use super::photo::PhotoData;
use super::surface::{DOWN, RIGHT, SurfaceMap};

/// What is known of the depth measurement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing {
    /// Quantisation of inverse depth [1/m]; 0 when depth is continuous. Half of it is how far a result may be from
    /// its measurement.
    pub step: f32,
    /// A surface inclined by more than this against the picture plane is a jump between two surfaces [tan angle].
    pub steepest: f32,
    /// Most sweeps of the relaxation.
    pub sweeps: u32,
}

impl Smoothing {
    /// For a continuous depth map: only completes it.
    pub fn continuous() -> Self {
        // 80°: a surface seen closer to its edge shows no texture to measure depth by.
        Self { step: 0.0, steepest: 5.67, sweeps: 300 }
    }

    /// For an integer disparity map: one step is `scale / (focal_px · baseline)`, with the focal length [px] at the
    /// disparity map's own size and the baseline in metres.
    pub fn integer_disparity(focal_px: f32, baseline: f32, scale: f32) -> Self {
        Self { step: (scale / (focal_px * baseline)).abs(), ..Self::continuous() }
    }
}

/// Completes and smooths the depth of `labels`.
///
/// Works on inverse depth, where a disparity map is evenly quantised and planes are linear in the pixel. Neighbours
/// of one label are linked unless inverse depth jumps by more than quantisation and the steepest slope explain. The
/// result is the membrane of least Σ (q_a − q_b)² over the links that stays within half a step of every
/// measurement (projected SOR): terraces become slopes, while no label edge or depth edge is crossed.
///
/// # Errors
/// [`GeometryError::EmptyMask`], [`GeometryError::DepthUnknown`], and bad sizes as in [`PhotoData::check`].
pub fn smooth(photo: &PhotoData, labels: &[u8], options: &Smoothing) -> Result<SurfaceMap, GeometryError> {
    let mut checked;
    let photo = {
        checked = photo.clone();
        checked.check()?;
        &checked
    };
    positive("the steepest slope", f64::from(options.steepest))?;
    let labels: Vec<u8> = labels.iter().copied().filter(|&l| l != 0).collect();
    for &label in &labels {
        let pixels = photo.labels.iter().filter(|&&l| l == label).count();
        if pixels == 0 {
            return Err(GeometryError::EmptyMask { label });
        }
        if !photo.labels.iter().zip(&photo.depth).any(|(&l, &z)| l == label && z > 0.0) {
            return Err(GeometryError::DepthUnknown { label, pixels });
        }
    }

    let slope = options.steepest / photo.focal_px;
    // A jump of one step is the edge of a terrace, two a surface seen at a grazing angle; medians of two terraces
    // make half steps: so 2.25 and not 2.
    let edge = |q: f32| (2.25 * options.step).max(slope * q);
    let done = complete(photo, &labels, edge);
    let (width, height) = (photo.width as usize, photo.height as usize);
    let mut map = SurfaceMap {
        width: photo.width,
        height: photo.height,
        camera: photo.camera(),
        labels: photo.labels.iter().map(|l| if labels.contains(l) { *l } else { 0 }).collect(),
        depth: Vec::new(),
        links: vec![0; photo.labels.len()],
    };
    let linked = |a: usize, b: usize| {
        if map.labels[a] == 0 || map.labels[a] != map.labels[b] {
            return false;
        }
        let (qa, qb) = (done.inverse[a], done.inverse[b]);
        // Two completed pixels bring values from places far apart: a slope of 0.3 edges a pixel is let pass there.
        let apart = (done.distance[a] + done.distance[b]) as f32;
        let reach = if done.surface[a] == done.surface[b] { 1.0 + 0.3 * apart } else { 1.0 };
        (qa - qb).abs() <= reach * edge(qa.min(qb))
    };
    for k in 0..map.links.len() {
        let right = (k % width + 1 < width && linked(k, k + 1)).then_some(RIGHT);
        let down = (k / width + 1 < height && linked(k, k + width)).then_some(DOWN);
        map.links[k] = right.unwrap_or(0) | down.unwrap_or(0);
    }
    let mut inverse = done.inverse;
    relax(&map, &mut inverse, &done.distance, options);
    map.depth = inverse.iter().map(|&q| if q > 0.0 { 1.0 / q } else { 0.0 }).collect();
    Ok(map)
}

/// Projected successive over-relaxation to the membrane of least energy within half a step of the measurements.
fn relax(map: &SurfaceMap, inverse: &mut [f32], distance: &[u32], options: &Smoothing) {
    const OVER: f32 = 1.8;
    let width = map.width as usize;
    let half = 0.5 * options.step;
    // Quantised pixels and completed ones move; with continuous depth only the completed ones do.
    let moving: Vec<usize> =
        (0..inverse.len()).filter(|&k| map.labels[k] != 0 && (half > 0.0 || distance[k] > 0)).collect();
    let measured = inverse.to_vec();
    let mean = |q: &[f32], k: usize| {
        let (mut sum, mut count) = (0.0, 0.0);
        let mut add = |n: usize| {
            sum += q[n];
            count += 1.0;
        };
        if map.links[k] & RIGHT != 0 {
            add(k + 1);
        }
        if map.links[k] & DOWN != 0 {
            add(k + width);
        }
        if !k.is_multiple_of(width) && map.links[k - 1] & RIGHT != 0 {
            add(k - 1);
        }
        if k >= width && map.links[k - width] & DOWN != 0 {
            add(k - width);
        }
        if count > 0.0 { sum / count } else { q[k] }
    };
    for _ in 0..options.sweeps {
        let mut most = 0.0_f32;
        for &k in &moving {
            let mut q = inverse[k] + OVER * (mean(inverse, k) - inverse[k]);
            if distance[k] == 0 {
                q = q.clamp(measured[k] - half, measured[k] + half);
            }
            most = most.max((q - inverse[k]).abs() / inverse[k]);
            inverse[k] = q;
        }
        // A hundred thousandth of the depth is far below what a picture shows.
        if most < 1e-5 {
            break;
        }
    }
    // The membrane has kinks where it touches its bounds: a few plain averages round them.
    for _ in 0..4 {
        let before = inverse.to_vec();
        for &k in &moving {
            inverse[k] = 0.5 * (before[k] + mean(&before, k));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEP: f32 = 1.0 / 600.0;

    /// Inverse depth given per pixel, quantised; the whole picture is label 1.
    fn photo(width: u32, height: u32, inverse: impl Fn(f32, f32) -> f32) -> PhotoData {
        let n = (width * height) as usize;
        let depth = (0..n)
            .map(|k| {
                let q = inverse((k % width as usize) as f32 + 0.5, (k / width as usize) as f32 + 0.5);
                1.0 / ((q / STEP).round() * STEP)
            })
            .collect();
        PhotoData {
            width,
            height,
            rgb: vec![[90; 3]; n],
            labels: vec![1; n],
            depth,
            focal_px: 1870.0,
            principal: [width as f32 / 2.0, height as f32 / 2.0],
        }
    }

    fn quantised() -> Smoothing {
        Smoothing { step: STEP, ..Smoothing::continuous() }
    }

    #[test]
    fn a_quantised_plane_comes_back() {
        // A step every 25 px across and 40 px down: terraces as broad as a leaf.
        let plane = |u: f32, v: f32| 0.7 + STEP * (u / 25.0 + v / 40.0);
        let p = photo(200, 120, plane);
        let map = smooth(&p, &[1], &quantised()).unwrap();
        let (mut square, mut most, mut count) = (0.0_f32, 0.0_f32, 0.0);
        let mut raw = 0.0_f32;
        for k in 0..map.depth.len() {
            let [u, v] = map.pixel_center(k);
            let error = (1.0 / map.depth[k] - plane(u, v)).abs() / STEP;
            most = most.max(error);
            // The last terrace at each border has nothing to lean on and stays flat.
            if u > 25.0 && u < 175.0 && v > 40.0 && v < 80.0 {
                square += error * error;
                raw += ((1.0 / p.depth[k] - plane(u, v)) / STEP).powi(2);
                count += 1.0;
            }
        }
        let (rms, raw) = ((square / count).sqrt(), (raw / count).sqrt());
        assert!(raw > 0.25, "the test must start from terraces: {raw}");
        assert!(rms < 0.06, "rms {rms} steps");
        // Half a step from the measurement, which is half a step from the plane.
        assert!(most < 1.0, "worst {most} steps");
    }

    #[test]
    fn a_depth_edge_inside_the_mask_stays_sharp() {
        let p = photo(80, 40, |u, v| if u < 40.0 { 0.70 } else { 0.72 } + STEP * v / 15.0);
        let map = smooth(&p, &[1], &quantised()).unwrap();
        for j in 0..40 {
            let (a, b) = (j * 80 + 39, j * 80 + 40);
            assert!(!map.linked(a, b));
            let jump = 1.0 / map.depth[b] - 1.0 / map.depth[a];
            // 0.02 as given, up to half a step of quantisation at each side.
            assert!((jump - 0.02).abs() < 1.01 * STEP, "{jump}");
        }
    }

    #[test]
    fn unknown_pixels_take_their_own_surface() {
        // Two leaves; the hole straddles their edge. Colour says where the edge runs.
        let mut p = photo(60, 40, |u, _| if u < 30.0 { 0.70 } else { 0.75 });
        for k in 0..p.rgb.len() {
            let u = k % 60;
            p.rgb[k] = if u < 30 { [40, 120, 40] } else { [90, 180, 60] };
            if (24..33).contains(&u) && (10..30).contains(&(k / 60)) {
                p.depth[k] = 0.0;
            }
        }
        let map = smooth(&p, &[1], &quantised()).unwrap();
        for k in 0..map.depth.len() {
            let truth = if k % 60 < 30 { 0.70 } else { 0.75 };
            assert!((1.0 / map.depth[k] - truth).abs() <= STEP, "pixel {k}: {}", 1.0 / map.depth[k]);
        }
    }

    #[test]
    fn other_labels_never_lend_depth() {
        let mut p = photo(40, 20, |_, _| 0.7);
        for k in 0..p.labels.len() {
            if k % 40 >= 20 {
                p.labels[k] = 2;
                p.depth[k] = 0.5;
            }
        }
        // An island of label 1 among label 2 without depth, and unknown pixels at the border.
        let island = 10 * 40 + 35;
        p.labels[island] = 1;
        p.depth[island] = 0.0;
        p.depth[5 * 40 + 19] = 0.0;
        let map = smooth(&p, &[1, 2], &Smoothing::continuous()).unwrap();
        for k in [island, 5 * 40 + 19] {
            assert!((map.depth[k] - p.depth[0]).abs() < 1e-5, "{}", map.depth[k]);
        }
        assert!(map.depth.iter().zip(&map.labels).all(|(&z, &l)| l != 2 || z == 0.5));
    }

    #[test]
    fn speckles_are_measured_anew_and_continuous_depth_is_kept() {
        let mut p = photo(40, 40, |u, _| 0.7 + 1e-4 * u);
        p.depth[20 * 40 + 20] = 5.0;
        let map = smooth(&p, &[1], &Smoothing::continuous()).unwrap();
        assert!((map.depth[820] - p.depth[819]).abs() < 1e-2, "{}", map.depth[820]);
        assert!((map.depth[0] - p.depth[0]).abs() < 1e-6);
    }

    #[test]
    fn sampling_is_linear_inside_and_stops_at_the_edge() {
        let mut p = photo(20, 20, |_, _| 0.7);
        for k in 0..400 {
            p.depth[k] = if k % 20 < 10 { 1.0 } else { 2.0 };
        }
        let map = smooth(&p, &[1], &Smoothing::continuous()).unwrap();
        let ramp: Vec<f32> = (0..400).map(|k| (k % 20) as f32 + 0.5).collect();
        assert!((map.sample(&ramp, [5.25, 7.8]).unwrap() - 5.25).abs() < 1e-5);
        assert_eq!(map.sample(&map.depth, [9.999, 7.0]), Some(map.depth[9]));
        assert_eq!(map.sample(&map.depth, [10.0, 7.0]), Some(map.depth[10]));
        assert_eq!(map.sample(&map.depth, [20.0, 7.0]), None);
    }

    #[test]
    fn a_mask_without_pixels_or_depth_is_named() {
        let mut p = photo(10, 10, |_, _| 0.7);
        let text = smooth(&p, &[3], &quantised()).unwrap_err().to_string();
        assert!(text.starts_with("label 3 has no pixels"), "{text}");
        p.depth.fill(0.0);
        let text = smooth(&p, &[1], &quantised()).unwrap_err().to_string();
        assert_eq!(
            text,
            "none of the 100 pixels of label 1 has a known depth; give a depth map that covers the object"
        );
    }
}

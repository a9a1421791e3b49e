//! Up and ground of a photograph: the plane the objects stand on and the world it defines. Must not know objects
//! beyond their masks.

use glam::{DMat3, DVec3, Mat3, Vec3};

use super::error::GeometryError;
use super::photo::PhotoData;

/// The ground in camera axes: points x with normal · x = −height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GroundPlane {
    /// Unit normal, up.
    pub normal: Vec3,
    /// Height of the camera above the plane [m].
    pub height: f32,
    /// Background points that were searched, and those that lie on the plane.
    pub candidates: usize,
    pub inliers: usize,
}

/// The rigid transform x_world = rotation · x_camera + translation. World: z up, y into the picture, x right, in
/// metres; the origin is the point of the ground under the camera, or the camera itself.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorldFromCamera {
    pub rotation: Mat3,
    /// Position of the camera in the world [m].
    pub translation: Vec3,
}

impl WorldFromCamera {
    /// The world of a camera `height` [m] above the origin (0: the camera is the origin) with `up` in camera axes.
    ///
    /// # Errors
    /// [`GeometryError::BadUp`] when up is no direction or lies along the view axis, which leaves y undefined.
    pub fn new(up: Vec3, height: f32) -> Result<Self, GeometryError> {
        let bad = GeometryError::BadUp(up.to_array());
        let Some(z) = up.as_dvec3().try_normalize() else { return Err(bad) };
        let flat = DVec3::Z - z * z.z;
        if flat.length() < 1e-3 {
            return Err(bad);
        }
        let y = flat.normalize();
        let rotation = DMat3::from_cols(y.cross(z), y, z).transpose();
        Ok(Self { rotation: rotation.as_mat3(), translation: Vec3::new(0.0, 0.0, height) })
    }

    /// World coordinates [m] of a point in camera axes.
    pub fn to_world(&self, point: Vec3) -> Vec3 {
        self.rotation * point + self.translation
    }

    /// Camera coordinates [m] of a world point.
    pub fn to_camera(&self, point: Vec3) -> Vec3 {
        self.rotation.transpose() * (point - self.translation)
    }
}

/// Up in the picture, in OpenCV axes.
const IMAGE_UP: DVec3 = DVec3::new(0.0, -1.0, 0.0);
/// Hypotheses. With a quarter of the candidates on the plane, 3-point samples miss it 500 times in a row once in
/// 3,000; scoring them costs milliseconds.
const HYPOTHESES: u64 = 500;
/// Candidates scored per hypothesis; more do not change which plane wins.
const SCORED: usize = 4000;
/// A point is on the plane within this fraction of its depth: two steps of an 8-bit disparity.
const TOLERANCE: f64 = 0.004;
/// Candidates begin this fraction of the picture's height above the objects' lowest row.
const MARGIN: f32 = 0.12;
/// The ground must hold this share of the candidates.
const LEAST_SHARE: f64 = 0.1;

/// Finds the ground with RANSAC among background points from just above the lowest row of the objects `labels`
/// downwards, on planes that face up within 45° of image-up (with `up` given: on planes of exactly that normal)
/// and do not cut off more than a twentieth of the objects' points; then refines by least squares. Without these
/// restrictions the largest plane is often a wall, and gravity would point into the picture. Same seed, same plane.
///
/// # Errors
/// [`GeometryError::NoGround`], [`GeometryError::EmptyMask`], [`GeometryError::BadUp`],
/// [`GeometryError::SizeMismatch`].
pub fn find_ground(
    photo: &PhotoData,
    labels: &[u8],
    up: Option<Vec3>,
    seed: u64,
) -> Result<GroundPlane, GeometryError> {
    photo.check_sizes()?;
    let width = photo.width as usize;
    let is_object = |k: usize| photo.labels[k] != 0 && labels.contains(&photo.labels[k]);
    let Some(lowest) = (0..photo.labels.len()).rev().find(|&k| is_object(k)).map(|k| k / width) else {
        return Err(GeometryError::EmptyMask { label: labels.first().copied().unwrap_or(0) });
    };
    let first_row = lowest.saturating_sub((MARGIN * photo.height as f32) as usize);
    let points = |of: &dyn Fn(usize) -> bool, from: usize| -> Vec<DVec3> {
        let all: Vec<usize> = (from * width..photo.depth.len()).filter(|&k| photo.depth[k] > 0.0 && of(k)).collect();
        let camera = photo.camera();
        all.iter()
            .map(|&k| {
                let pixel = [(k % width) as f32 + 0.5, (k / width) as f32 + 0.5];
                camera.unproject(pixel, photo.depth[k]).as_dvec3()
            })
            .collect()
    };
    let candidates = points(&|k| photo.labels[k] == 0, first_row);
    let objects = thinned(&points(&is_object, 0));
    let given = match up {
        Some(up) => Some(up.as_dvec3().try_normalize().ok_or(GeometryError::BadUp(up.to_array()))?),
        None => None,
    };
    let enough = ((LEAST_SHARE * candidates.len() as f64) as usize).max(3);
    let plane = search(&candidates, &objects, given, FACING_UP, seed);
    plane
        .filter(|p| p.inliers >= enough)
        .ok_or(GeometryError::NoGround { candidates: candidates.len(), inliers: plane.map_or(0, |p| p.inliers) })
}

/// Least cosine between a plane's normal and image-up: 45°.
const FACING_UP: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// The plane n · x = d with the most points on it.
fn search(points: &[DVec3], objects: &[DVec3], given: Option<DVec3>, facing: f64, seed: u64) -> Option<GroundPlane> {
    if points.len() < 3 {
        return None;
    }
    let scored = thinned(points);
    let mut best: Option<(usize, DVec3, f64)> = None;
    for trial in 0..HYPOTHESES {
        let pick = |corner: u64| points[(random(seed, 3 * trial + corner) % points.len() as u64) as usize];
        let (a, b, c) = (pick(0), pick(1), pick(2));
        let Some(normal) = given.or_else(|| (b - a).cross(c - a).try_normalize()) else { continue };
        let normal = if given.is_none() && normal.dot(IMAGE_UP) < 0.0 { -normal } else { normal };
        if given.is_none() && normal.dot(IMAGE_UP) < facing {
            continue;
        }
        let offset = normal.dot(a);
        let below = objects.iter().filter(|p| normal.dot(**p) - offset < -TOLERANCE * p.z).count();
        if 20 * below > objects.len() {
            continue;
        }
        let count = scored.iter().filter(|p| on_plane(normal, offset, **p, TOLERANCE)).count();
        if best.is_none_or(|b| count > b.0) {
            best = Some((count, normal, offset));
        }
    }
    let (_, mut normal, mut offset) = best?;
    // Each round's plane is better, so that its inliers can be chosen more narrowly: what merely passes near the
    // plane, like the foot of a wall, is left out.
    // Twenty rounds bring all hypotheses near one plane to the same refined plane.
    for round in 0..20 {
        let tolerance = TOLERANCE * f64::max(0.5, 1.0 - 0.2 * f64::from(round));
        let on: Vec<DVec3> = points.iter().copied().filter(|p| on_plane(normal, offset, *p, tolerance)).collect();
        let Some((n, d)) = fit(&on, given) else { break };
        let n = if n.dot(normal) < 0.0 { (-n, -d) } else { (n, d) };
        (normal, offset) = n;
    }
    let inliers = points.iter().filter(|p| on_plane(normal, offset, **p, TOLERANCE)).count();
    Some(GroundPlane { normal: normal.as_vec3(), height: -offset as f32, candidates: points.len(), inliers })
}

fn on_plane(normal: DVec3, offset: f64, p: DVec3, tolerance: f64) -> bool {
    (normal.dot(p) - offset).abs() < tolerance * p.z
}

/// Every n-th point, about [`SCORED`] of them.
fn thinned(points: &[DVec3]) -> Vec<DVec3> {
    points.iter().copied().step_by(points.len().div_ceil(SCORED).max(1)).collect()
}

/// Least-squares plane of points: the direction of least variance, by inverse iteration on the covariance.
fn fit(points: &[DVec3], given: Option<DVec3>) -> Option<(DVec3, f64)> {
    if points.len() < 3 {
        return None;
    }
    let mean = points.iter().sum::<DVec3>() / points.len() as f64;
    if let Some(normal) = given {
        return Some((normal, normal.dot(mean)));
    }
    let mut covariance = DMat3::ZERO;
    for p in points {
        let d = *p - mean;
        covariance += DMat3::from_cols(d * d.x, d * d.y, d * d.z);
    }
    // A millionth of the size keeps the inverse of an exact plane finite.
    let size = covariance.x_axis.x + covariance.y_axis.y + covariance.z_axis.z;
    let inverse = (covariance + DMat3::from_diagonal(DVec3::splat(1e-6 * size))).inverse();
    let mut normal = IMAGE_UP;
    for _ in 0..50 {
        normal = (inverse * normal).try_normalize()?;
    }
    Some((normal, normal.dot(mean)))
}

/// The n-th number of the stream `seed`: SplitMix64's output function of a counter.
fn random(seed: u64, n: u64) -> u64 {
    let mut x = seed.wrapping_add(n.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15));
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A table `drop` below a camera that looks down by `tilt`, a wall 2 m away, and a ball-sized mask on the table.
    fn table_and_wall(drop: f32, tilt: f32) -> (PhotoData, Vec3) {
        let (w, h) = (160_u32, 120_u32);
        let up = Vec3::new(0.0, -tilt.cos(), -tilt.sin());
        let mut photo = PhotoData {
            width: w,
            height: h,
            rgb: vec![[0; 3]; (w * h) as usize],
            labels: vec![0; (w * h) as usize],
            depth: vec![0.0; (w * h) as usize],
            focal_px: 200.0,
            principal: [80.0, 60.0],
        };
        for k in 0..photo.depth.len() {
            let (i, j) = (k % 160, k / 160);
            let ray = photo.camera().unproject([i as f32 + 0.5, j as f32 + 0.5], 1.0);
            let table = -drop / up.dot(ray);
            // Half a millimetre of seeded noise.
            let noise = 1.0 + 5e-4 * ((random(1, k as u64) % 1000) as f32 / 500.0 - 1.0);
            photo.depth[k] = noise * if table > 0.0 && table < 2.0 { table } else { 2.0 };
            if (60..100).contains(&i) && (60..100).contains(&j) {
                photo.labels[k] = 1;
                photo.depth[k] = if table > 0.0 { (0.9 * table).min(1.2) } else { 1.2 };
            }
        }
        (photo, up)
    }

    #[test]
    fn the_table_is_found_and_the_wall_is_not() {
        for (drop, tilt) in [(0.4, 0.0), (0.35, 0.2), (0.5, 0.05)] {
            let (photo, up) = table_and_wall(drop, tilt);
            let plane = find_ground(&photo, &[1], None, 7).unwrap();
            // The table is seen from 1.3 m on; the wall's lowest row is within the tolerance and tilts the plane by
            // about a millimetre a metre.
            assert!(plane.normal.dot(up) > 1.0 - 1e-5, "{} for {up}", plane.normal);
            assert!((plane.height - drop).abs() < 3e-3, "{} for {drop}", plane.height);
            assert_eq!(find_ground(&photo, &[1], None, 7).unwrap(), plane);
            let fixed = find_ground(&photo, &[1], Some(up), 8).unwrap();
            assert!((fixed.height - drop).abs() < 1e-3);
        }
    }

    #[test]
    fn without_the_restrictions_the_wall_wins() {
        let (photo, _) = table_and_wall(0.4, 0.0);
        let all: Vec<DVec3> = (0..photo.depth.len())
            .filter(|&k| photo.labels[k] == 0)
            .map(|k| {
                photo.camera().unproject([(k % 160) as f32 + 0.5, (k / 160) as f32 + 0.5], photo.depth[k]).as_dvec3()
            })
            .collect();
        let wall = search(&all, &[], None, 0.0, 7).unwrap();
        assert!(wall.normal.z.abs() > 0.99, "{}", wall.normal);
    }

    #[test]
    fn a_picture_without_a_table_says_so() {
        let (mut photo, _) = table_and_wall(0.4, 0.0);
        for (z, l) in photo.depth.iter_mut().zip(&photo.labels) {
            if *l == 0 {
                *z = 2.0;
            }
        }
        let text = find_ground(&photo, &[1], None, 7).unwrap_err().to_string();
        assert!(text.contains("no ground found") && text.contains("set `ground.height`"), "{text}");
        assert_eq!(find_ground(&photo, &[5], None, 7), Err(GeometryError::EmptyMask { label: 5 }));
    }

    #[test]
    fn the_world_is_right_handed_with_z_up_and_y_into_the_picture() {
        let world = WorldFromCamera::new(Vec3::new(0.0, -1.0, 0.0), 0.3).unwrap();
        assert_eq!(world.to_world(Vec3::ZERO), Vec3::new(0.0, 0.0, 0.3));
        assert_eq!(world.to_world(Vec3::new(1.0, 0.3, 2.0)), Vec3::new(1.0, 2.0, 0.0));
        let tilted = WorldFromCamera::new(Vec3::new(0.1, -0.9, -0.3), 1.0).unwrap();
        assert!((tilted.rotation.determinant() - 1.0).abs() < 1e-6);
        let p = Vec3::new(0.2, -0.4, 1.7);
        assert!(tilted.to_camera(tilted.to_world(p)).distance(p) < 1e-6);
        for bad in [Vec3::Z, Vec3::ZERO, Vec3::new(f32::NAN, 0.0, 0.0)] {
            assert!(matches!(WorldFromCamera::new(bad, 0.0), Err(GeometryError::BadUp(_))));
        }
    }
}

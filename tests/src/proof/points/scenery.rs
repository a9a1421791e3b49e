//! Seeded discs, points and cameras to draw. Knows no kernel.

use glam::{DMat3, DVec3};
use physvideo_gpu::kernels::Camera;

use super::Disc;
use crate::proof::Ask;
use crate::random::Random;
use crate::twins::points::View;

/// Discs in multiples of 1/64 px at one of 64 depths: f32 rounds nothing near their rims, so rims and equal depths
/// have one right answer. One in twenty is not drawn.
pub fn discs(ask: Ask, size: [u32; 2]) -> Vec<[f32; 4]> {
    let mut random = Random::new(ask.seed ^ 0xd15c);
    let mut discs: Vec<[f32; 4]> = (0..ask.items).map(|_| disc(&mut random, size)).collect();
    if ask.poison {
        for (turn, d) in discs.iter_mut().skip(3).step_by(16).enumerate() {
            match turn % 8 {
                0 => d[0] = 1e30,
                1 => d[1] = -1e30,
                2 => d[3] = 1e9,
                3 => d[2] = 1e30,
                4 => *d = [2.5, 3.5, 0.25, 1e-12], // one pixel, barely
                5 => d[0] = -3e38,
                6 => d[2] = 1e38, // no blend depth is 3e38
                _ => *d = [0.0; 4],
            }
        }
    }
    discs
}

fn disc(random: &mut Random, size: [u32; 2]) -> [f32; 4] {
    if random.chance(0.05) {
        return [0.0; 4];
    }
    // Halves of pixels put rims on pixel centres.
    let step = if random.chance(0.3) { 2 } else { 64 };
    let mut place = |side: u32| random.below((side as usize + 8) * step) as f32 / step as f32 - 4.0;
    let (x, y) = (place(size[0]), place(size[1]));
    let depth = 0.5 + random.below(64) as f32 / 64.0;
    let radius = 0.5 + random.below(5 * step / 2) as f32 / step as f32;
    [x, y, depth, radius]
}

/// World points with a camera that sees them.
pub struct Scenery {
    /// Position [m] and radius, of which the camera sees some.
    pub points: Vec<[f32; 4]>,
    /// Pinhole.
    pub camera: Camera,
    /// Radii are pixels.
    pub pixels: bool,
    /// What rounding may decide, in the terms of `twins::points::Scene::margin`.
    pub margin: [f64; 2],
}

impl Scenery {
    /// Even seeds see a quarter turn in powers of two, which f32 projects exactly: rims, equal depths and the near
    /// plane count. Odd seeds see any turn. Radii are pixels in the second half of four seeds.
    pub fn new(ask: Ask, size: [u32; 2]) -> Self {
        let mut random = Random::new(ask.seed ^ 0x5ce7e);
        let (exact, pixels) = (ask.seed.is_multiple_of(2), ask.seed % 4 >= 2);
        let camera = if exact { quarter(size) } else { turned(size) };
        let view = View::of(&camera);
        let discs = discs(Ask { poison: false, ..ask }, size);
        let mut points: Vec<[f32; 4]> = Vec::new();
        for [x, y, z, r] in discs.into_iter().map(|d| d.map(f64::from)) {
            let z = match (exact, random.below(16)) {
                (true, turn) => [0.25, 0.5, 1.0, 2.0, 4.0][turn % 5],
                (false, 0) => -z, // behind the camera
                (false, 1) => 0.1,
                (false, _) => 2.0 * z + 0.01 * f64::from(random.range(-1.0, 1.0)),
            };
            // Off the grid, else the rims of many would lie where rounding decides.
            let [x, y] = if exact { [x, y] } else { [x, y].map(|c| c + f64::from(random.range(-0.4, 0.4))) };
            let q = DVec3::new((x - view.center.x) * z / view.focal.x, (y - view.center.y) * z / view.focal.y, z);
            let at = view.rotation.transpose() * (q - view.translation);
            let radius = if pixels { r } else { r * z / view.focal.x };
            points.push([at.x as f32, at.y as f32, at.z as f32, radius as f32]);
        }
        if ask.poison {
            for (turn, p) in points.iter_mut().skip(3).step_by(16).enumerate() {
                match turn % 10 {
                    0 => p[0] = f32::NAN,
                    1 => p[1] = f32::INFINITY,
                    2 => p[2] = f32::NEG_INFINITY,
                    3 => p[3] = f32::NAN,
                    4 => p[3] = f32::INFINITY,
                    5 => p[3] = -1.0,
                    6 => p[3] = 0.0,
                    7 => p[3] = 1e9,
                    8 => p[1] = 1e30,
                    _ => *p = [f32::NAN; 4],
                }
            }
        }
        Self { points, camera, pixels, margin: if exact { [0.0; 2] } else { [1e-3, 1e-5] } }
    }

    /// The discs of the points.
    pub fn discs(&self) -> Vec<Disc> {
        let view = View::of(&self.camera);
        self.points.iter().map(|p| view.disc(*p, self.pixels)).collect()
    }
}

fn quarter(size: [u32; 2]) -> Camera {
    Camera {
        right: [0.0, 1.0, 0.0, 0.25],
        down: [0.0, 0.0, -1.0, -0.5],
        forward: [-1.0, 0.0, 0.0, 0.75],
        focal: [64.0, 32.0],
        center: size.map(|s| s as f32 / 2.0),
        near: 0.5,
        ..Default::default()
    }
}

/// A camera turned about an axis of no symmetry.
pub fn turned(size: [u32; 2]) -> Camera {
    let rows = DMat3::from_axis_angle(DVec3::new(0.48, -0.6, 0.64), 1.1).transpose();
    let row = |r: DVec3, t: f32| [r.x as f32, r.y as f32, r.z as f32, t];
    Camera {
        right: row(rows.x_axis, 0.3),
        down: row(rows.y_axis, -0.2),
        forward: row(rows.z_axis, 0.45),
        focal: [61.3, 58.9],
        center: size.map(|s| s as f32 * 0.47),
        near: 0.3,
        ..Default::default()
    }
}

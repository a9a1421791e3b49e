//! The pinhole camera of a photograph: pixels and depth to camera coordinates and back. Must not know the world.

use glam::{DVec3, Vec3};

/// A pinhole without distortion, in OpenCV axes (x right, y down, z forward). The centre of pixel (i, j) is at
/// (i + 0.5, j + 0.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pinhole {
    /// Focal length [px].
    pub focal_px: f32,
    /// Principal point [px].
    pub principal: [f32; 2],
}

impl Pinhole {
    /// The point [m] seen at `pixel` [px] at depth `z` [m] along the view axis.
    pub fn unproject(&self, pixel: [f32; 2], z: f32) -> Vec3 {
        let f = f64::from(self.focal_px);
        let z = f64::from(z);
        let x = (f64::from(pixel[0]) - f64::from(self.principal[0])) / f;
        let y = (f64::from(pixel[1]) - f64::from(self.principal[1])) / f;
        DVec3::new(x * z, y * z, z).as_vec3()
    }

    /// The pixel [px] and depth [m] of a camera-space point [m]; `None` behind the camera.
    pub fn project(&self, point: Vec3) -> Option<([f32; 2], f32)> {
        if point.z <= 0.0 {
            return None;
        }
        let p = point.as_dvec3();
        let f = f64::from(self.focal_px);
        let u = f * p.x / p.z + f64::from(self.principal[0]);
        let v = f * p.y / p.z + f64::from(self.principal[1]);
        Some(([u as f32, v as f32], point.z))
    }

    /// How much longer the ray through `pixel` is than its depth: |ray| / z, at least 1.
    pub fn stretch(&self, pixel: [f32; 2]) -> f32 {
        let x = (pixel[0] - self.principal[0]) / self.focal_px;
        let y = (pixel[1] - self.principal[1]) / self.focal_px;
        (1.0 + x * x + y * y).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_centre_looks_forward_and_axes_are_opencv() {
        let camera = Pinhole { focal_px: 100.0, principal: [32.0, 24.0] };
        assert_eq!(camera.unproject([32.0, 24.0], 2.0), Vec3::new(0.0, 0.0, 2.0));
        assert_eq!(camera.unproject([132.0, 74.0], 2.0), Vec3::new(2.0, 1.0, 2.0));
        assert_eq!(camera.project(Vec3::new(0.0, 0.0, -1.0)), None);
    }

    #[test]
    fn project_undoes_unproject() {
        let camera = Pinhole { focal_px: 1867.0, principal: [319.7, 277.1] };
        for (u, v, z) in [(0.5, 0.5, 1.2), (639.5, 553.5, 1.9), (320.5, 11.5, 0.3)] {
            let ([pu, pv], pz) = camera.project(camera.unproject([u, v], z)).unwrap();
            // One f32 rounding of x and y: 320 px · 2⁻²⁴ is 2e-5 px.
            assert!((pu - u).abs() < 1e-4 && (pv - v).abs() < 1e-4 && pz == z, "{u} {v} -> {pu} {pv}");
        }
    }
}

//! Cameras as kernels read them, from cameras as scenes state them. Knows nothing of what is drawn.

use glam::Vec3;
use physvideo_gpu::kernels::Camera;

use crate::geometry::{PhotoData, WorldFromCamera};

/// What is nearer than this is not drawn [m].
pub const NEAR: f32 = 1e-3;

/// A camera with OpenCV axes (x right, y down, z forward) from the rows of its rotation, camera-from-world, its
/// position [m], focal lengths [px] and principal point [px].
pub fn camera(axes: [Vec3; 3], eye: Vec3, focal: [f32; 2], center: [f32; 2]) -> Camera {
    let row = |axis: Vec3| [axis.x, axis.y, axis.z, -axis.dot(eye)];
    Camera {
        right: row(axes[0]),
        down: row(axes[1]),
        forward: row(axes[2]),
        focal,
        center,
        near: NEAR,
        ..Default::default()
    }
}

/// The camera that took a photograph.
pub fn of_photo(photo: &PhotoData, world: &WorldFromCamera) -> Camera {
    let r = world.rotation;
    camera([r.x_axis, r.y_axis, r.z_axis], world.translation, [photo.focal_px; 2], photo.principal)
}

/// The camera of a scene for an image of `width` × `height` pixels, z up. Looking straight up or down, the top of the
/// image is +y. An eye at its target looks along +y.
pub fn look_at(view: &crate::scene::Camera, width: u32, height: u32) -> Camera {
    let eye = Vec3::from(view.eye);
    let forward = (Vec3::from(view.target) - eye).try_normalize().unwrap_or(Vec3::Y);
    let right = forward.cross(Vec3::Z).try_normalize().unwrap_or_else(|| forward.cross(Vec3::Y).normalize_or(Vec3::X));
    let down = forward.cross(right);
    #[expect(clippy::cast_precision_loss, reason = "image sizes are far below 2^24")]
    let (w, h) = (width as f32, height as f32);
    let focal = 0.5 * h / (0.5 * view.fov_y.to_radians()).tan();
    camera([right, down, forward], eye, [focal; 2], [0.5 * w, 0.5 * h])
}

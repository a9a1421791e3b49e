//! From pixels to the world and back, and layers over a picture.

use glam::DVec3;
use physvideo::stages::view;
use physvideo_gpu::kernels::{Background as Behind, Camera, DepthMap, Screen, points};
use physvideo_gpu::{Constants, Recording};
use physvideo_tests::twins::points::View;

use super::{Random, SIZES, gpu, silent};

#[test]
fn unproject_and_project_are_inverse() {
    let gpu = gpu(&[]);
    for [w, h] in [[1u32, 1], [7, 9], [65, 1], [640, 48]] {
        let n = u64::from(w * h);
        let mut r = Random(n);
        let scene = physvideo::scene::Camera { eye: [0.3, -1.0, 1.2], target: [0.2, 0.5, 0.4], fov_y: 50.0 };
        let camera = Camera { focal: [600.0; 2], ..view::look_at(&scene, w, h) };
        let mut depth: Vec<f32> = (0..n).map(|_| r.float(0.5, 4.0)).collect();
        let unknown = [f32::NAN, 0.0, -1.0, f32::INFINITY];
        for (z, u) in depth.iter_mut().skip(2).step_by(7).zip(unknown.iter().cycle()) {
            *z = *u;
        }
        let camera_buf = gpu.upload("run", "camera", &[camera]).unwrap();
        let points = gpu.alloc("run", "points", n).unwrap();
        let splats = gpu.alloc("run", "splats", n).unwrap();
        let depths = gpu.upload("run", "depths", &depth).unwrap();
        let mut rec = Recording::new("round trip");
        let immediates = DepthMap { width: w, height: h, spacing: 0.5 };
        rec.each(&points::Unproject { depths, camera: camera_buf, points, immediates }, &Constants::none(), n);
        let immediates = Screen { width: w, height: h, points: n as u32 };
        rec.each(&points::Project { points, camera: camera_buf, splats, immediates }, &Constants::none(), n);
        gpu.run(&rec).unwrap();
        let (world, back) = (gpu.read(points).unwrap(), gpu.read(splats).unwrap());
        let view = View::of(&camera);
        for (i, z) in depth.iter().enumerate() {
            if !(z.is_finite() && *z > 0.0) {
                assert_eq!((world[i], back[i]), ([0.0; 4], [0.0; 4]), "unknown depth {z}");
                continue;
            }
            let (x, y) = (i as u32 % w, i as u32 / w);
            let wanted = view.unproject(x, y, f64::from(*z));
            let got = DVec3::from([0, 1, 2].map(|c| f64::from(world[i][c])));
            // A dot product of three terms of up to 5 m, in f32.
            assert!((got - wanted).length() < 1e-6 * (f64::from(*z) + 2.0), "{got} is not {wanted}");
            // 1e-6 of the coordinates: metres of up to z + 2 (the eye is 1.6 m from the origin), seen as pixels.
            let size = 600.0 * (z + 2.0) / z;
            let off = [back[i][0] - x as f32 - 0.5, back[i][1] - y as f32 - 0.5, back[i][2] - z, back[i][3] - 0.5];
            let scale = [size, size, z + 2.0, 0.5];
            assert!(off.iter().zip(scale).all(|(o, s)| o.abs() <= 1e-6 * s), "pixel {x} {y}: {off:?}");
        }
    }
    silent(&gpu);
}

#[test]
fn composition_is_exact() {
    let gpu = gpu(&[]);
    for n in SIZES {
        let mut r = Random(n as u64);
        let mut layer: Vec<u32> = (0..n).map(|_| r.bits() as u32).collect();
        for (i, p) in layer.iter_mut().enumerate() {
            *p = [*p | 0xff00_0000, *p & 0x00ff_ffff, *p][i % 3];
        }
        let picture: Vec<u32> = (0..n).map(|_| r.bits() as u32).collect();
        let layer_buf = gpu.upload("run", "layer", &layer).unwrap();
        let background = gpu.upload("run", "picture", &picture).unwrap();
        for use_picture in [true, false] {
            let image = gpu.alloc("run", "image", n as u64).unwrap();
            let immediates = Behind { pixels: n as u32, color: 0xff0a_c81e };
            let mut rec = Recording::new("compose");
            let constants = Constants::none().with("PICTURE", f64::from(u8::from(use_picture)));
            rec.each(&points::Compose { layer: layer_buf, background, image, immediates }, &constants, n as u64);
            gpu.run(&rec).unwrap();
            let image = gpu.read(image).unwrap();
            for i in 0..n {
                let under = if use_picture { picture[i] } else { 0xff0a_c81e };
                let byte = |word: u32, c: usize| f64::from(word.to_le_bytes()[c]);
                for c in 0..3 {
                    let alpha = byte(layer[i], 3) / 255.0;
                    let wanted = alpha * byte(layer[i], c) + (1.0 - alpha) * byte(under, c);
                    assert!((byte(image[i], c) - wanted).abs() <= 0.5, "{wanted}");
                }
                assert_eq!(image[i] >> 24, 255);
            }
        }
    }
    silent(&gpu);
}

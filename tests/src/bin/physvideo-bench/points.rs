//! One frame of points, as `tools/peers/bench_points.py` draws it: projected, depth-tested, coloured.

use std::time::Instant;

use glam::Vec3;
use physvideo::stages::render::{Display, PointRenderer, RenderSettings};
use physvideo::stages::view;
use physvideo_gpu::{Gpu, GpuError, Recording};
use physvideo_tests::random::Random;

/// Times frames with the radius of the disc that covers a pixel, the nearest point of each.
pub fn bench(gpu: &Gpu, points: usize, [width, height]: [u32; 2], repeats: usize) -> Result<(), String> {
    let say = |e: GpuError| e.to_string();
    let mut random = Random::new(0);
    let cloud: Vec<[f32; 4]> = (0..points)
        .map(|_| {
            let x = random.vector(0.5);
            [x[0], x[1], x[2], 0.5]
        })
        .collect();
    let (w, h) = (width as f32, height as f32);
    let camera = view::camera([Vec3::X, Vec3::Y, Vec3::Z], Vec3::new(0.0, 0.0, -2.0), [0.9 * h; 2], [w / 2.0, h / 2.0]);
    let display = Display {
        points: gpu.upload("run", "points", &cloud).map_err(say)?,
        colors: gpu.upload("run", "colors", &vec![0xff33_66ff_u32; points]).map_err(say)?,
        objects: gpu.upload("run", "objects", &vec![1u32; points]).map_err(say)?,
        count: points as u64,
        camera: gpu.upload("run", "camera", &[camera]).map_err(say)?,
    };
    let settings = RenderSettings { width, height, per_pixel: 1, radius_in_pixels: true, ..RenderSettings::default() };
    let renderer = PointRenderer::new(gpu, settings, display).map_err(|e| e.to_string())?;
    let mut frame = Recording::new("frame");
    renderer.record(&mut frame);
    let prepared = gpu.prepare(&frame).map_err(say)?;
    prepared.submit().map_err(say)?; // drivers compile at the first dispatch
    let mut times: Vec<f64> = (0..repeats.max(1))
        .map(|_| {
            let begin = Instant::now();
            prepared.submit().map(|_| begin.elapsed().as_secs_f64() * 1e3)
        })
        .collect::<Result<_, _>>()
        .map_err(say)?;
    times.sort_by(f64::total_cmp);
    println!("{points} points, {width} x {height}: {:.2} ms a frame [best {:.2}]", times[times.len() / 2], times[0]);
    for (stage, ms) in crate::stages(gpu, frame).map_err(say)? {
        println!("    {stage:<16} {ms:>8.2} ms");
    }
    Ok(())
}

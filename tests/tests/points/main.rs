//! `points/*` against their f64 twins: every path of the renderer, projection, carried points, composition.

mod carry;
mod pixels;

use glam::{DVec3, Vec3};
use physvideo::scene::Compositing;
use physvideo::stages::render::{Background, Display, Image, PointRenderer, RenderError, RenderSettings};
use physvideo::stages::view;
use physvideo_gpu::kernels::{Camera, DepthMap, points};
use physvideo_gpu::{Constants, Feature, Gpu, Options, Recording};
use physvideo_tests::twins::points::{self as twin, Pixel, View};

/// Every size a kernel meets: none, one, around a workgroup, many.
const SIZES: [usize; 6] = [0, 1, 63, 64, 65, 1000];
/// Sides that are and are not whole tiles.
const IMAGES: [[u32; 2]; 4] = [[1, 1], [13, 7], [64, 48], [65, 33]];
const QUARANTINED: u32 = 0x8000_0000;

fn gpu(without: &[Feature]) -> Gpu {
    let without = without.to_vec();
    Gpu::new(Options { validation: true, bounds_checks: true, without, ..Default::default() }).unwrap()
}

/// The device as it is, and one that offers neither subgroups nor 64-bit atomics.
fn both() -> [Gpu; 2] {
    [gpu(&[]), gpu(&[Feature::Subgroup, Feature::Int64Atomic])]
}

fn silent(gpu: &Gpu) {
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Seeded, the same on every machine (SplitMix64).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
    fn below(&mut self, n: u64) -> u64 {
        self.bits() % n
    }
    fn float(&mut self, from: f32, to: f32) -> f32 {
        from + (to - from) * (self.bits() >> 40) as f32 / (1u64 << 24) as f32
    }
    fn vec(&mut self, from: f32, to: f32) -> Vec3 {
        Vec3::new(self.float(from, to), self.float(from, to), self.float(from, to))
    }
}

struct Cloud {
    points: Vec<[f32; 4]>,
    colors: Vec<u32>,
    objects: Vec<u32>,
    camera: Camera,
}

/// A scene in which f32 is exact: pixels and radii are multiples of 1/8, depths 1, 2 or 4 (so that many are equal).
/// Points lie on pixel centres, rims go through pixel centres, some points are not to be drawn.
fn exact(n: usize, [w, h]: [u32; 2]) -> Cloud {
    let mut r = Random(n as u64 * 1000 + u64::from(w));
    let center = [w as f32 / 2.0, h as f32 / 2.0];
    let camera = view::camera([Vec3::X, Vec3::Y, Vec3::Z], Vec3::ZERO, [64.0; 2], center);
    let eighths = |r: &mut Random, side: u32| (r.below(u64::from(side) * 8 + 64) as f32 - 32.0) / 8.0;
    let mut points: Vec<[f32; 4]> = (0..n)
        .map(|_| {
            let z = [1.0, 2.0, 4.0][r.below(3) as usize];
            let [px, py] = [eighths(&mut r, w), eighths(&mut r, h)];
            let radius = [0.5, 1.0, 1.25, 2.5, 5.0][r.below(5) as usize];
            [(px - center[0]) * z / 64.0, (py - center[1]) * z / 64.0, z, radius]
        })
        .collect();
    let spoil: [fn(&mut [f32; 4]); 9] = [
        |p| p[0] = f32::NAN,
        |p| p[2] = f32::NAN,
        |p| p[3] = f32::NAN,
        |p| p[1] = f32::INFINITY,
        |p| p[3] = f32::INFINITY,
        |p| p[2] = -p[2],
        |p| p[2] = 0.0,
        |p| p[3] = 0.0,
        |p| p[3] = -1.0,
    ];
    for (p, spoil) in points.iter_mut().step_by(5).zip(spoil.iter().cycle()) {
        spoil(p);
    }
    cloud(points, camera, r)
}

/// A scene seen by a turned camera, radii in metres.
fn general(n: usize, [w, h]: [u32; 2]) -> Cloud {
    let mut r = Random(n as u64 * 77 + u64::from(h));
    let points = (0..n).map(|_| r.vec(-1.0, 1.0).extend(r.float(0.01, 0.15)).to_array()).collect();
    let scene = physvideo::scene::Camera { eye: [2.0, -3.0, 1.5], target: [0.1, 0.0, 0.2], fov_y: 40.0 };
    cloud(points, view::look_at(&scene, w, h), r)
}

fn cloud(points: Vec<[f32; 4]>, camera: Camera, mut r: Random) -> Cloud {
    let colors = points.iter().map(|_| r.bits() as u32).collect();
    let objects = points.iter().map(|_| 1 + r.below(3) as u32).collect();
    Cloud { points, colors, objects, camera }
}

fn display(gpu: &Gpu, c: &Cloud) -> Display {
    Display {
        points: gpu.upload("run", "points", &c.points).unwrap(),
        colors: gpu.upload("run", "colors", &c.colors).unwrap(),
        objects: gpu.upload("run", "objects", &c.objects).unwrap(),
        count: c.points.len() as u64,
        camera: gpu.upload("run", "camera", &[c.camera]).unwrap(),
    }
}

fn settings([width, height]: [u32; 2], k: u32, compositing: Compositing) -> RenderSettings {
    RenderSettings {
        width,
        height,
        per_pixel: k,
        compositing,
        radius_in_pixels: true,
        depth: true,
        ids: true,
        ..Default::default()
    }
}

fn drawn(gpu: &Gpu, c: &Cloud, s: &RenderSettings) -> Image {
    PointRenderer::new(gpu, s.clone(), display(gpu, c)).unwrap().draw(gpu).unwrap()
}

fn twin_of(c: &Cloud, s: &RenderSettings, margin: [f64; 2], closed: bool) -> Vec<Pixel> {
    let view = View::of(&c.camera);
    let discs: Vec<_> = c.points.iter().map(|p| view.disc(*p, s.radius_in_pixels)).collect();
    twin::draw(&twin::Scene {
        discs: &discs,
        colors: &c.colors,
        objects: &c.objects,
        size: [s.width, s.height],
        k: s.per_pixel as usize,
        compositing: s.compositing,
        blend_depth: s.blend_depth.map(f64::from),
        margin,
        closed,
    })
}

/// Pixels where the image is not what the twin says; those the twin is unsure of are not looked at.
fn differing(image: &Image, twin: &[Pixel]) -> Vec<String> {
    let (depths, ids) = (image.depth.as_ref().unwrap(), image.ids.as_ref().unwrap());
    assert_eq!(twin.len(), depths.len());
    let wrong = twin.iter().enumerate().filter(|(_, p)| !p.unsure).filter(|(i, p)| {
        let rgb = DVec3::from([0, 1, 2].map(|c| f64::from(image.rgb[3 * i + c])));
        // Half a step of rounding, and 255 · 8 weights · 2⁻²⁴ · a few roundings of the sum.
        let color = (rgb - p.rgb).abs().max_element() <= 0.5 + 2e-3;
        // Depth is one dot product away from the input.
        let depth = (f64::from(depths[*i]) - p.depth).abs() <= 1e-6 * p.depth;
        !color || !depth || ids[*i] != p.id
    });
    wrong
        .map(|(i, p)| format!("pixel {i}: {:?} {} {} is not {p:?}", &image.rgb[3 * i..3 * i + 3], depths[i], ids[i]))
        .collect()
}

/// The ways a point is blended: both compositors, PyTorch3D's and with a blend depth.
fn ways(size: [u32; 2], k: u32) -> Vec<RenderSettings> {
    let mut all = Vec::new();
    for compositing in [Compositing::NormWeighted, Compositing::Alpha] {
        for blend_depth in [None, Some(1.0)] {
            all.push(RenderSettings { blend_depth, ..settings(size, k, compositing) });
        }
    }
    all
}

#[test]
fn every_path_draws_what_pytorch3d_defines() {
    for gpu in both() {
        for (size, n) in IMAGES.into_iter().flat_map(|s| SIZES.map(|n| (s, n))) {
            let c = exact(n, size);
            for k in [1, 3, 8] {
                for s in ways(size, k) {
                    // Everything is exact here, so nothing may be left out of the comparison.
                    let wrong = differing(&drawn(&gpu, &c, &s), &twin_of(&c, &s, [0.0; 2], false));
                    assert!(wrong.is_empty(), "{n} points, {s:?}: {} pixels, first {}", wrong.len(), wrong[0]);
                }
            }
            gpu.free_arena("run");
        }
        silent(&gpu);
    }
}

#[test]
fn a_turned_camera_and_radii_in_metres() {
    for gpu in both() {
        for (size, k) in [([65, 33], 1), ([65, 33], 8), ([64, 48], 4)] {
            let c = general(1000, size);
            for s in ways(size, k) {
                let s = RenderSettings { radius_in_pixels: false, blend_depth: s.blend_depth.map(|_| 0.3), ..s };
                // f32 projects to about 65 · 4 · 2⁻²⁴ = 2e-5 px and 5e-7 of the depth.
                let twin = twin_of(&c, &s, [1e-4, 2e-6], false);
                let unsure = twin.iter().filter(|p| p.unsure).count();
                assert!(unsure * 20 < twin.len(), "the twin is unsure of {unsure} pixels");
                let wrong = differing(&drawn(&gpu, &c, &s), &twin);
                assert!(wrong.is_empty(), "{s:?}: {} pixels, first {}", wrong.len(), wrong[0]);
            }
        }
        silent(&gpu);
    }
}

#[test]
fn a_rim_through_a_pixel_centre_does_not_hit_it() {
    let gpu = gpu(&[]);
    // A disc of radius 2 around a pixel centre of a 9 × 9 image: the rim passes four pixel centres.
    let camera = view::camera([Vec3::X, Vec3::Y, Vec3::Z], Vec3::ZERO, [64.0; 2], [4.5; 2]);
    let c = cloud(vec![[0.0, 0.0, 1.0, 2.0]], camera, Random(3));
    for k in [1, 8] {
        let s = settings([9, 9], k, Compositing::NormWeighted);
        let image = drawn(&gpu, &c, &s);
        assert_eq!(differing(&image, &twin_of(&c, &s, [0.0; 2], false)), Vec::<String>::new());
        // Negative control: with d² ≤ r² four more pixels are hit.
        assert_eq!(differing(&image, &twin_of(&c, &s, [0.0; 2], true)).len(), 4);
    }
    silent(&gpu);
}

#[test]
fn all_paths_and_all_runs_give_the_same_bits() {
    let [fast, plain] = both();
    for size in [[65, 33], [64, 48]] {
        let c = Cloud { points: exact(1000, size).points, ..general(1000, size) };
        for k in [1, 5, 8] {
            for s in ways(size, k) {
                let image = drawn(&fast, &c, &s);
                assert_eq!(image, drawn(&fast, &c, &s), "two runs, {s:?}");
                assert_eq!(image, drawn(&plain, &c, &s), "without subgroups and 64-bit atomics, {s:?}");
            }
        }
        // One point alone: K makes no difference.
        let one = Cloud { points: vec![[0.1, 0.05, 3.0, 4.3]], ..exact(1, size) };
        let with = |k| drawn(&fast, &one, &settings(size, k, Compositing::Alpha));
        assert_eq!(with(1), with(8));
        assert!(with(1).ids.unwrap().contains(&one.objects[0]));
    }
    silent(&fast);
    silent(&plain);
}

#[test]
fn lists_that_overflow_are_seen_and_grown() {
    for gpu in both() {
        let mut c = exact(1000, [64, 48]);
        for p in &mut c.points {
            p[3] *= 8.0;
        }
        let s = settings([64, 48], 8, Compositing::NormWeighted);
        let mut renderer = PointRenderer::new(&gpu, s.clone(), display(&gpu, &c)).unwrap();
        let mut rec = Recording::new("once");
        renderer.record(&mut rec);
        gpu.run(&rec).unwrap();
        assert!(renderer.missing(&gpu).unwrap() > 0, "the scene is meant not to fit");
        let image = renderer.draw(&gpu).unwrap();
        assert_eq!(renderer.missing(&gpu).unwrap(), 0);
        assert_eq!(differing(&image, &twin_of(&c, &s, [0.0; 2], false)), Vec::<String>::new());
        silent(&gpu);
    }
}

#[test]
fn lists_beyond_the_device_are_refused() {
    let mut gpu = gpu(&[]);
    gpu.info.max_buffer = 4 * 4096;
    let mut c = exact(900, [64, 48]);
    for p in &mut c.points {
        p[3] *= 8.0;
    }
    let s = settings([64, 48], 8, Compositing::NormWeighted);
    let refused = PointRenderer::new(&gpu, s, display(&gpu, &c)).unwrap().draw(&gpu);
    let text = refused.unwrap_err().to_string();
    assert!(text.contains("900 points") && text.contains("radius smaller"), "{text}");
}

#[test]
fn what_is_not_asked_for_is_not_allocated() {
    let gpu = gpu(&[]);
    let c = exact(64, [64, 48]);
    let all = display(&gpu, &c);
    let before = gpu.memory_used().0;
    let s = RenderSettings { depth: false, ids: false, ..settings([64, 48], 1, Compositing::NormWeighted) };
    let image = PointRenderer::new(&gpu, s.clone(), all).unwrap().draw(&gpu).unwrap();
    assert_eq!((image.depth, image.ids), (None, None));
    // Two outputs of one texel each stand in for the images that are not made.
    assert_eq!(gpu.memory_used().0 - before, s.bytes(64, false) + 32);
    let full = drawn(&gpu, &c, &RenderSettings { depth: true, ids: true, ..s });
    assert_eq!(image.rgb, full.rgb);
    silent(&gpu);
}

#[test]
fn settings_that_cannot_be_drawn_are_refused() {
    let gpu = gpu(&[]);
    let c = exact(64, [16, 16]);
    let good = settings([16, 16], 8, Compositing::NormWeighted);
    let refuse = |s: RenderSettings, word: &str| {
        let text = match PointRenderer::new(&gpu, s, display(&gpu, &c)) {
            Err(e @ RenderError::Settings(_)) => e.to_string(),
            other => panic!("{other:?}"),
        };
        assert!(text.contains(word), "{text}");
    };
    refuse(RenderSettings { width: 0, ..good.clone() }, "0 × 16");
    refuse(RenderSettings { height: 20_000, ..good.clone() }, "16 × 20000");
    refuse(RenderSettings { per_pixel: 9, ..good.clone() }, "9 points");
    refuse(RenderSettings { per_pixel: 0, ..good.clone() }, "0 points");
    refuse(RenderSettings { blend_depth: Some(f32::NAN), ..good.clone() }, "blend depth");
    let small = gpu.upload("run", "picture", &[0u32; 10]).unwrap();
    refuse(RenderSettings { background: Some(Background::Picture(small)), ..good }, "10 pixels");
}

/// A photograph unprojected and drawn by the camera that took it is the photograph.
#[test]
fn the_first_frame_is_the_photograph() {
    let [w, h] = [65u32, 33];
    let gpu = gpu(&[]);
    let n = u64::from(w * h);
    let mut r = Random(9);
    let scene = physvideo::scene::Camera { eye: [0.3, -1.0, 1.2], target: [0.0, 0.5, 0.1], fov_y: 35.0 };
    let camera = gpu.upload("run", "camera", &[view::look_at(&scene, w, h)]).unwrap();
    let depth: Vec<f32> = (0..n).map(|_| r.float(1.0, 1.3)).collect();
    let points = gpu.alloc("run", "points", n).unwrap();
    let photo: Vec<u32> = (0..n).map(|_| r.bits() as u32 | 0xff00_0000).collect();
    let colors = gpu.upload("run", "colors", &photo).unwrap();
    let objects = gpu.upload("run", "objects", &vec![1u32; n as usize]).unwrap();
    let mut rec = Recording::new("unproject");
    let depths = gpu.upload("run", "depths", &depth).unwrap();
    // 0.98 of a pixel: a neighbour's disc at another depth, measured in its own pixels, does not reach this centre.
    let immediates = DepthMap { width: w, height: h, spacing: 0.98 };
    rec.each(&points::Unproject { depths, camera, points, immediates }, &Constants::none(), n);
    gpu.run(&rec).unwrap();
    let wanted: Vec<u8> = photo.iter().flat_map(|p| p.to_le_bytes().into_iter().take(3)).collect();
    for k in [1, 8] {
        for s in ways([w, h], k) {
            let background = Some(Background::Color([1, 2, 3]));
            let s = RenderSettings { radius_in_pixels: false, background, ..s };
            let all = Display { points, colors, objects, count: n, camera };
            let image = PointRenderer::new(&gpu, s.clone(), all).unwrap().draw(&gpu).unwrap();
            assert!(image.rgb == wanted, "{s:?}");
        }
    }
    silent(&gpu);
}

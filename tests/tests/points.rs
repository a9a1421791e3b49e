//! `points/*` against their f64 twins: every path of the renderer, projection, carried points, composition.

use glam::{DMat3, DVec3, Mat3, Vec3};
use physvideo::scene::Compositing;
use physvideo::stages::render::{Background, Display, Image, PointRenderer, RenderError, RenderSettings};
use physvideo::stages::view;
use physvideo_gpu::kernels::{
    Background as Behind, Bound, Camera, Carried, Carrier, Deformation, DepthMap, Particle, Screen, points,
};
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

/// Runs `points/bind` on the first state and `points/carry` on the second.
fn carried(gpu: &Gpu, rest: &[[f32; 4]], carriers: &[Carrier], then: &[State], now: &[State]) -> Vec<[f32; 4]> {
    let bound = gpu.alloc::<Bound>("run", "bound", then.len() as u64).unwrap();
    let upload = |s: &[State]| {
        let particles: Vec<_> =
            s.iter().map(|s| Particle { x: s.x.into(), tag: s.tag, ..Default::default() }).collect();
        let column = |s: &State, i: usize| s.f.col(i).extend(1e-6).to_array();
        let f = s.iter().map(|s| Deformation { f0: column(s, 0), f1: column(s, 1), f2: column(s, 2) });
        let f: Vec<_> = f.collect();
        (gpu.upload("run", "particles", &particles).unwrap(), gpu.upload("run", "deformations", &f).unwrap())
    };
    let mut rec = Recording::new("bind");
    let (particles, deformations) = upload(then);
    let immediates = Carried { count: then.len() as u32 };
    rec.each(&points::Bind { particles, deformations, bound, immediates }, &Constants::none(), then.len() as u64);
    let (particles, deformations) = upload(now);
    let points = gpu.alloc("run", "points", rest.len() as u64).unwrap();
    let call = points::Carry {
        rest: gpu.upload("run", "rest", rest).unwrap(),
        carriers: gpu.upload("run", "carriers", carriers).unwrap(),
        particles,
        deformations,
        bound,
        points,
        immediates: Carried { count: rest.len() as u32 },
    };
    rec.each(&call, &Constants::none(), rest.len() as u64);
    gpu.run(&rec).unwrap();
    let mut out = gpu.read(points).unwrap();
    out.truncate(rest.len());
    out
}

#[derive(Clone, Copy)]
struct State {
    x: Vec3,
    f: Mat3,
    tag: u32,
}

#[test]
fn points_are_carried_by_their_particles() {
    let gpu = gpu(&[]);
    let turn = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, -1.0).normalize(), 1.1);
    let shift = Vec3::new(0.3, -0.2, 0.7);
    for n in SIZES {
        let mut r = Random(n as u64);
        let squeezed =
            |r: &mut Random| Mat3::IDENTITY + Mat3::from_cols(r.vec(-0.3, 0.3), r.vec(-0.3, 0.3), r.vec(-0.3, 0.3));
        let then: Vec<_> = (0..100).map(|_| State { x: r.vec(-1.0, 1.0), f: squeezed(&mut r), tag: 0 }).collect();
        let rest: Vec<_> = (0..n).map(|_| r.vec(-1.0, 1.0).extend(0.01).to_array()).collect();
        let carriers: Vec<_> = (0..n)
            .map(|i| {
                let particle = [0; 4].map(|_: u32| r.below(100) as u32);
                // Every fourth point is carried by nothing.
                let weight = if i % 4 == 3 { [0.0; 4] } else { [0.7, r.float(0.0, 1.0), r.float(0.0, 1.0), 0.0] };
                Carrier { particle, weight }
            })
            .collect();
        // Nothing moved, whatever F is: not a bit changes beyond the rounding of F F⁻¹.
        for (a, b) in carried(&gpu, &rest, &carriers, &then, &then).iter().zip(&rest) {
            assert!((Vec3::from_slice(a) - Vec3::from_slice(b)).length() < 1e-6);
        }
        let straight: Vec<_> = then.iter().map(|s| State { f: Mat3::IDENTITY, ..*s }).collect();
        assert_eq!(carried(&gpu, &rest, &carriers, &straight, &straight), rest);
        // A rigid motion of all particles moves all points rigidly.
        let rigid: Vec<_> = then.iter().map(|s| State { x: turn * s.x + shift, f: turn * s.f, tag: 0 }).collect();
        for (i, p) in carried(&gpu, &rest, &carriers, &then, &rigid).iter().enumerate() {
            let x = Vec3::from_slice(&rest[i]);
            let wanted = if i % 4 == 3 { x } else { turn * x + shift };
            // Coordinates of up to 3 m through two products of 3 × 3 matrices in f32.
            assert!((Vec3::from_slice(p) - wanted).length() < 4e-6 && p[3] == 0.01, "point {i}: {p:?}, not {wanted}");
        }
        // Any motion: against the definition in f64.
        let bent: Vec<_> =
            then.iter().map(|s| State { x: s.x + r.vec(-0.2, 0.2), f: squeezed(&mut r), tag: 0 }).collect();
        for (i, p) in carried(&gpu, &rest, &carriers, &then, &bent).iter().enumerate().filter(|(i, _)| i % 4 != 3) {
            let by = (0..3).map(|k| {
                let id = carriers[i].particle[k] as usize;
                let [a, b] = [then[id], bent[id]];
                let wide = |m: Mat3| DMat3::from_cols_array(&m.to_cols_array().map(f64::from));
                let p = twin::Particle { x0: a.x.as_dvec3(), x: b.x.as_dvec3(), f0: wide(a.f), f: wide(b.f) };
                (p, f64::from(carriers[i].weight[k]))
            });
            let wanted = twin::carry(Vec3::from_slice(&rest[i]).as_dvec3(), &by.collect::<Vec<_>>());
            // As above; F up to 2, F⁻¹ up to about 10 here.
            assert!((Vec3::from_slice(p).as_dvec3() - wanted).length() < 2e-5, "point {i}: {p:?}, not {wanted}");
        }
    }
    silent(&gpu);
}

#[test]
fn quarantined_particles_carry_nothing() {
    let gpu = gpu(&[]);
    let at = |x: f32| State { x: Vec3::new(x, 0.0, 0.0), f: Mat3::IDENTITY, tag: 0 };
    let lost = State { x: Vec3::NAN, f: Mat3::NAN, tag: QUARANTINED | 3 };
    let carrier = Carrier { particle: [0, 1, 0, 0], weight: [0.5, 0.5, 0.0, 0.0] };
    let rest = [[0.5, 0.0, 0.0, 0.01]];
    let one = carried(&gpu, &rest, &[carrier], &[at(0.0), at(1.0)], &[lost, at(3.0)]);
    assert_eq!(one, [[2.5, 0.0, 0.0, 0.01]]);
    // With no carrier left the point is not drawn.
    let none = carried(&gpu, &rest, &[carrier], &[at(0.0), at(1.0)], &[lost, lost]);
    assert_eq!(none, [[0.5, 0.0, 0.0, 0.0]]);
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

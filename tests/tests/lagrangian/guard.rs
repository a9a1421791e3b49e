//! Steps beyond the limit, squeezed and inverted starts, bodies of any shape.

use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::stages::solver::{FrameStats, Solver};
use physvideo::world::{Body, World};
use physvideo_gpu::kernels::family::field::UNIFORM;
use physvideo_gpu::kernels::{Collider, Field};
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::device::{self, gpu};
use physvideo_tests::folder;

use super::setup::{body, fill, solver, world};

const DX: f64 = 1.0 / 16.0;
const JELLY: (f64, f64) = (5e5, 0.3);

/// A shape of jelly that is torn at by a random velocity, six frames of 50 ms without obstacles.
fn shake(shape: &str, change: impl Fn(&mut World)) -> (Vec<FrameStats>, f64) {
    let gpu = gpu();
    let mut w = world(vec![noisy(shape)], DX);
    change(&mut w);
    let mut s = solver(&gpu, &w);
    let m = s.measure(0).unwrap();
    let start = m.kinetic + m.elastic;
    let frames = (0..6).map(|_| s.frame(0.05).unwrap()).collect();
    let m = s.measure(0).unwrap();
    (frames, (m.kinetic + m.elastic) / start)
}

fn noisy(shape: &str) -> Body {
    let keep = |x: [f64; 3]| match shape {
        "ball" => x.iter().map(|c| c * c).sum::<f64>() < 0.2f64.powi(2),
        // Steps of every kind, single points and a plate one point thick.
        "ragged" => (x[0] + 2.0 * x[1] + 3.0 * x[2]).sin().abs() * 40.0 % 1.0 < 0.6 || x[2].abs() < DX / 4.0,
        _ => x.iter().all(|c| c.abs() < 0.125),
    };
    let mut random = physvideo_tests::random::Random::new(7);
    let all = fill(DX, [-0.25; 3], [0.25; 3], keep);
    let mut b = body(JELLY, 1000.0, DX, all, |_| [0.0; 3]);
    b.velocities.iter_mut().for_each(|v| *v = random.vector(0.5));
    b
}

fn faults(frames: &[FrameStats]) -> u32 {
    frames.iter().map(|f| f.clamped_velocity + f.quarantined).sum()
}

/// The default Courant number is stable for filled and for cut cells, and for points nearly alone; energy stays.
#[test]
fn bodies_of_any_shape_are_stable() {
    for shape in ["cube", "ball", "ragged"] {
        let (frames, kept) = shake(shape, |_| {});
        let rejected: u32 = frames.iter().map(|f| f.rejected).sum();
        println!("{shape}: {kept:.4} of the energy, {rejected} rejected");
        assert!(faults(&frames) == 0 && rejected == 0, "{shape}: {frames:?}");
        // Symplectic Euler near its limit swings about the energy; it must not drift.
        assert!((kept - 1.0).abs() < 0.2, "{shape}: {kept}");
    }
}

#[test]
fn a_step_too_long_is_taken_back_and_remembered() {
    let (frames, kept) = shake("cube", |w| w.courant = 1.9);
    assert!(frames.iter().any(|f| f.rejected > 0), "1.9 is beyond the limit: {frames:?}");
    assert_eq!(faults(&frames), 0, "what remains is clean: {frames:?}");
    assert!((kept - 1.0).abs() < 0.3, "{kept}");
    // Control: a step that is forced is not taken back; it blows up, and that is counted.
    let (forced, _) = shake("cube", |w| w.force_dt = Some(1.9 * w.dx / w.wave_speeds().1));
    assert!(faults(&forced) > 0 && forced.iter().all(|f| f.rejected == 0));
}

/// A block whose middle, three cells wide, is mapped by diag(scale) around its own middle: share of the points with
/// J < 0.05 at the start and 0.1 s later, and of the energy.
fn recover(gpu: &Gpu, scale: [f64; 3]) -> (f64, f64, f64) {
    let cube = fill(DX, [0.0; 3], [0.5; 3], |_| true);
    let w = world(vec![body(JELLY, 1000.0, DX, cube, |_| [0.0; 3])], DX);
    let mut s = solver(gpu, &w);
    let inside = |x: [f64; 3]| x.iter().all(|c| (c - 0.25).abs() < 1.6 * DX);
    let squeezed = |x: [f64; 3], a: usize| if inside(x) { (scale[a] - 1.0) * (x[a] - 0.25) } else { 0.0 };
    s.set(|x| (std::array::from_fn(|a| squeezed(x, a)), [0.0; 3])).unwrap();
    let wrong = |s: &dyn Solver| {
        let all = gpu.read(s.deformations()).unwrap();
        let j = |d: &physvideo_gpu::kernels::Deformation| {
            let column = |f: [f32; 4]| glam::Vec3::new(f[0], f[1], f[2]);
            glam::Mat3::from_cols(column(d.f0), column(d.f1), column(d.f2)).determinant()
        };
        all.iter().filter(|d| j(d) < 0.05).count() as f64 / all.len() as f64
    };
    let (before, start) = (s.measure(0).unwrap(), wrong(&s));
    for _ in 0..20 {
        let stats = s.frame(0.005).unwrap();
        // What was squeezed to nothing or beyond flies apart at many times the speed of waves: a frame may be repeated.
        assert!(stats.clamped_velocity + stats.quarantined == 0, "{stats:?}");
    }
    let m = s.measure(0).unwrap();
    (start, wrong(&s), (m.kinetic + m.elastic) / (before.kinetic + before.elastic))
}

#[test]
fn squeezed_and_inverted_bodies_recover() {
    let gpu = gpu();
    for scale in [[0.01; 3], [-0.3, 1.0, 1.0]] {
        let (start, end, kept) = recover(&gpu, scale);
        println!("by diag {scale:?}: {start:.4} of the points wrong, then {end:.4}, {kept:.3} of the energy");
        // A few that are inside out between others that are crushed take longer.
        assert!(start > 0.01 && end < 0.2 * start && kept < 1.15, "{start}, {end}, {kept}");
    }
}

/// A block of `thick` [m] (a cube of 15.6 kg, or a leaf), at rest, and a wall with some friction that comes from below at 4 m/s, from the side at 2 m/s:
/// what happened in ten frames of 5 ms, and the energy at the end [J]. Beside it may be a pile of sand on MPM's grid, which the
/// wall meets too.
fn swept(gpu: &Gpu, thick: f64, courant: f32, sand: bool) -> (Vec<FrameStats>, f64) {
    let cube = fill(DX, [0.0, 0.0, 0.01], [0.25, 0.25, 0.01 + thick], |_| true);
    let mut w = world(vec![body(JELLY, 1000.0, DX, cube, |_| [0.0; 3])], DX);
    w.courant = courant;
    w.colliders = vec![Collider {
        shape: physvideo_gpu::kernels::family::shape::PLANE,
        friction: 0.4,
        end: 1e9,
        size: [0.0, 0.0, 1.0, 0.0],
        velocity: [2.0, 0.0, 4.0, 0.0],
        ..Default::default()
    }];
    let mut s: Box<dyn Solver> = if sand {
        let mut pile =
            body((1e6, 0.3), 1600.0, DX, fill(DX, [0.5, 0.0, 0.01], [0.75, 0.25, 0.13], |_| true), |_| [0.0; 3]);
        pile.material = Material::Sand { young: 1e6, poisson: 0.3, friction: 0.6 };
        w.bodies.push(pile);
        w.domain = ([-1.0; 3], [2.0; 3]);
        Box::new(Mpm::beside(gpu, &w, Method::default(), &[true, false]).unwrap())
    } else {
        Box::new(solver(gpu, &w))
    };
    let frames = (0..10).map(|_| s.frame(0.005).unwrap()).collect();
    let m = s.measure(0).unwrap();
    drop(s);
    gpu.free_arena("run");
    gpu.free_arena("grid");
    (frames, m.kinetic + m.elastic)
}

/// What an obstacle gives is no gain from nowhere, and does not keep the guard from seeing one.
#[test]
fn the_work_of_an_obstacle_is_counted() {
    let gpu = gpu();
    for sand in [false, true] {
        let (frames, energy) = swept(&gpu, 0.25, 0.75, sand);
        println!("swept: {energy:.1} J");
        // Thrown at nearly twice the wall's speed, ½ m (2 v)² = 500 J, less what vibrates and comes back into the wall.
        assert!(energy > 200.0 && frames.iter().all(|f| f.gained + f.rejected == 0), "{energy} J, {frames:?}");
        assert!(frames.iter().map(|f| f.work).sum::<f64>() > 200.0 || !sand, "{frames:?}");
        // Beside the same obstacle, a step beyond the limit is seen and taken back.
        let (frames, _) = swept(&gpu, 0.25, 1.9, sand);
        assert!(frames.iter().any(|f| f.rejected > 0), "{frames:?}");
    }
    // Control: where nothing is counted the throw itself looks like a gain.
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), "lagrangian/contact", "if (COUNTS_WORK) {", "if (false) {");
    let blind = device::open(Options { wgsl: Some(copy.path().into()), ..device::options() });
    for sand in [false, true] {
        let (frames, _) = swept(&blind, 0.25, 0.75, sand);
        assert!(frames.iter().any(|f| f.gained > 0), "{frames:?}");
        // And no step mends it: the frame is kept, and said to be.
        assert!(frames.iter().any(|f| f.unmended && f.gained == 4 && f.rejected == 3), "{frames:?}");
    }
    // A leaf is judged as well as a block.
    let (frames, _) = swept(&gpu, 0.5 * DX, 0.75, false);
    assert!(frames.iter().all(|f| f.gained + f.rejected == 0), "{frames:?}");
    let (frames, _) = swept(&blind, 0.5 * DX, 0.75, false);
    assert!(frames.iter().any(|f| f.gained > 0), "{frames:?}");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// A field's push is no gain either, and what gains beside one is seen: a cube pushed at 100 m/s² has
/// 30 m/s at the end, where its first shaking was half of one.
#[test]
fn what_a_field_gives_is_no_gain() {
    let push = Field { kind: UNIFORM, end: 1e9, a: [100.0, 0.0, 0.0, 0.0], ..Default::default() };
    let pushed = |courant: f32| {
        shake("cube", |w| {
            w.fields = vec![push];
            w.bodies[0].fields = 1;
            w.courant = courant;
        })
    };
    let (frames, grown) = pushed(0.75);
    assert!(grown > 100.0 && frames.iter().all(|f| f.gained + f.rejected == 0), "{grown} times, {frames:?}");
    let (frames, _) = pushed(1.9);
    assert!(frames.iter().any(|f| f.rejected > 0), "{frames:?}");
}

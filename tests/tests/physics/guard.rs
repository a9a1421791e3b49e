//! The guard behind the step: a step that is too long blows a body up; the guard takes the frame back, goes on with
//! shorter ones, and remembers.

use physvideo::scene::Material;
use physvideo::stages::solver::FrameStats;
use physvideo::world::{World, ground};
use physvideo_gpu::kernels::family::{
    field::WIND,
    shape::{BALL, BOX},
};
use physvideo_gpu::kernels::{Collider, Field, Return};
use physvideo_tests::device::gpu;
use physvideo_tests::problems::setup::{Lattice, solver, world};
use physvideo_tests::stress::{self, MATERIALS};

/// A jelly block that falls on the ground and rebounds, for six frames of 20 ms; the limit of its steps is a Courant
/// number of about 1.15 (a filled lattice in 3-D).
fn drop(change: impl Fn(&mut World)) -> (Vec<FrameStats>, f64) {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 16.0);
    let cube = lattice.fill([0.0, 0.0, 0.01], [0.25, 0.25, 0.26], |_| true);
    let jelly = lattice.body(Material::Elastic { young: 5e5, poisson: 0.3 }, 1000.0, &cube, |_| [0.0, 0.0, -1.0]);
    let mut w = world(vec![jelly], lattice.dx, [-1.0; 3], [1.5; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.3)];
    change(&mut w);
    let mut mpm = solver(&gpu, &w, "updated_lagrangian").unwrap();
    let frames = (0..6).map(|_| mpm.frame(0.02).unwrap()).collect();
    let m = mpm.measure(0).unwrap();
    (frames, m.kinetic + m.elastic)
}

/// Kinetic energy of 15.6 kg at 1 m/s [J].
const FELL: f64 = 7.8;

fn faults(frames: &[FrameStats]) -> u32 {
    frames.iter().map(|f| f.clamped_velocity + f.quarantined).sum()
}

#[test]
fn a_step_too_long_is_taken_back_and_remembered() {
    let (calm, energy) = drop(|_| {});
    assert_eq!((faults(&calm), calm.iter().map(|f| f.rejected).sum::<u32>()), (0, 0));
    let (frames, guarded) = drop(|w| w.courant = 1.9);
    assert!(frames.iter().any(|f| f.rejected > 0), "1.9 is beyond the limit: {frames:?}");
    assert_eq!(faults(&frames), 0, "what remains is clean: {frames:?}");
    // Most of what it fell with went into the impact; how much depends on the step, and a blow-up adds many times that.
    assert!((guarded - energy).abs() < 0.1 * FELL, "{guarded} J, {energy} J with short steps");
    let last = frames.iter().rposition(|f| f.rejected > 0).unwrap();
    assert!(last < 4, "smaller steps are kept: {frames:?}");
    assert!(frames[5].dt.1 < 1.9 * calm[5].dt.1, "1.9 is 2.5 times 0.75: {frames:?}");
}

/// Control: a step that is forced is not taken back; it blows up, and that is counted.
#[test]
fn a_forced_step_is_taken_at_its_word() {
    let (calm, energy) = drop(|_| {});
    let (frames, blown) = drop(|w| w.force_dt = Some(2.5 * calm[0].dt.1));
    assert_eq!(frames.iter().map(|f| f.rejected).sum::<u32>(), 0);
    assert!(faults(&frames) > 0, "{frames:?}");
    assert!(blown.is_nan() || (blown - energy).abs() > 0.1 * FELL, "{blown} J, {energy} J with short steps");
}

/// A cube in free space that breathes at 0.2 m/s: per frame, energy over that at the start, and what happened.
fn breathe(change: impl Fn(&mut World)) -> Vec<(f64, FrameStats)> {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 16.0);
    let cube = lattice.fill([-0.125; 3], [0.125; 3], |_| true);
    let jelly =
        lattice.body(Material::Elastic { young: 5e5, poisson: 0.3 }, 1000.0, &cube, |x| [1.6 * x[0], -1.6 * x[1], 0.0]);
    let mut w = world(vec![jelly], lattice.dx, [-1.0; 3], [1.0; 3]);
    change(&mut w);
    let mut mpm = solver(&gpu, &w, "updated_lagrangian").unwrap();
    let begun = mpm.measure(0).unwrap().energy();
    (0..24)
        .map(|_| {
            let stats = mpm.frame(0.02).unwrap();
            (mpm.measure(0).unwrap().energy() / begun, stats)
        })
        .collect()
}

/// At a Courant number of 1.6 the shortest waves grow, and long before a node runs away the energy says so.
#[test]
fn a_gain_of_energy_is_taken_back() {
    let frames = breathe(|w| w.courant = 1.6);
    let stats: Vec<FrameStats> = frames.iter().map(|f| f.1).collect();
    assert!(stats.iter().map(|f| f.gained).sum::<u32>() > 0, "nothing was gained: {frames:?}");
    assert_eq!(
        stats.iter().map(|f| f.gained).sum::<u32>(),
        stats.iter().map(|f| f.rejected).sum::<u32>(),
        "{frames:?}"
    );
    assert_eq!(faults(&stats), 0, "{frames:?}");
    // The tenth that the guard lets pass.
    assert!(frames.iter().all(|f| f.0 < 1.1), "{frames:?}");
}

/// Control: with the same step forced the energy is many times that of the start before anything else is noticed.
#[test]
fn nothing_but_the_energy_tells_of_a_gain() {
    let step = 1.6 * f64::from(breathe(|w| w.courant = 0.75)[0].1.dt.1) / 0.75;
    let frames = breathe(|w| w.force_dt = Some(step as f32));
    let noticed = frames.iter().position(|f| faults(&[f.1]) > 0).unwrap_or(frames.len());
    assert!(frames[..noticed].iter().any(|f| f.0 > 3.0), "{frames:?}");
}

/// What moves and starts anew is judged too: an obstacle that meets nothing and a return that nothing reaches do not keep
/// the guard from seeing a gain.
#[test]
fn a_gain_is_seen_beside_moving_obstacles_and_returns() {
    let seen = |change: &dyn Fn(&mut World)| -> (u32, f64) {
        let frames = breathe(|w| {
            w.courant = 1.6;
            change(w);
        });
        (frames.iter().map(|f| f.1.gained).sum(), frames.iter().map(|f| f.0).fold(0.0, f64::max))
    };
    let far = [0.0, 0.0, -0.9, 0.0];
    let (gained, most) =
        seen(&|w| w.colliders = vec![Collider { center: far, velocity: [0.1, 0.0, 0.0, 0.0], ..ball(0.05) }]);
    assert!(gained > 0 && most < 1.1, "{gained} attempts taken back, {most} of the energy");
    let returns = Return { region: 1, region_min: [0.9; 4], region_max: [1.0; 4], solid: 1.0, ..Default::default() };
    let (gained, most) = seen(&|w| w.bodies[0].recycle = Some(returns));
    assert!(gained > 0 && most < 1.1, "{gained} attempts taken back, {most} of the energy");
}

fn ball(radius: f32) -> Collider {
    Collider { shape: BALL, end: 1e9, size: [radius, 0.0, 0.0, 0.0], ..Default::default() }
}

/// A paddle of 12 cm that turns at 20 rad/s through what lies on the ground, and a fast ball that comes from the side,
/// bring many times the energy at hand, and none of the frames is repeated for it.
#[test]
fn what_obstacles_give_is_no_gain() {
    let gpu = gpu();
    for name in MATERIALS {
        let mut setup = stress::step::drop(stress::material_of(name), 1000.0, 0.5);
        let paddle = Collider {
            shape: BOX,
            size: [0.12, 0.03, 0.12, 0.0],
            center: [0.125, 0.125, 0.1, 0.0],
            spin: [0.0, 0.0, 20.0, 0.0],
            friction: 0.3,
            start: 0.1,
            ..ball(0.0)
        };
        let fast = Collider { center: [-0.3, 0.125, 0.15, 0.0], velocity: [4.0, 0.0, 0.0, 0.0], ..ball(0.08) };
        // The liquid lets a paddle begin inside it; what has a shape would be torn, and meets the ball alone.
        setup.world.colliders.push(if name == "liquid" || name == "sand" { paddle } else { fast });
        let mut mpm = solver(&gpu, &setup.world, "updated_lagrangian").unwrap();
        let begun = mpm.measure(0).unwrap().kinetic;
        let mut most: f64 = 0.0;
        for frame in 0..12 {
            let stats = mpm.frame(0.02).unwrap();
            assert_eq!((stats.rejected, stats.gained, faults(&[stats])), (0, 0, 0), "{name}, frame {frame}: {stats:?}");
            most = most.max(mpm.measure(0).unwrap().kinetic);
        }
        assert!(most > 4.0 * begun, "{name}: {most} J, {begun} J at the start: this test tests nothing");
    }
}

/// Falls, splashes and slides as they should be lose energy, and none of their frames is repeated.
#[test]
fn clean_runs_are_never_taken_back() {
    let gpu = gpu();
    for name in MATERIALS {
        let setup = stress::step::drop(stress::material_of(name), 1000.0, 2.0);
        let mut mpm = solver(&gpu, &setup.world, "updated_lagrangian").unwrap();
        for frame in 0..20 {
            let stats = mpm.frame(0.02).unwrap();
            assert_eq!((stats.rejected, stats.gained, faults(&[stats])), (0, 0, 0), "{name}, frame {frame}: {stats:?}");
        }
        assert!(mpm.measure(0).unwrap().height < 0.2 * 1000.0 / 64.0, "{name} has not come down");
    }
}

/// Two blocks fall side by side 5 m below the height at which gravity's energy is 0, and one goes over the domain's edge:
/// that is no fault of the steps, and the 49 J/kg that it lacked are no gain of the other (4 J/kg).
#[test]
fn what_leaves_the_domain_is_no_fault() {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 16.0);
    let block = |x: f64, speed: f64| {
        let all = lattice.fill([x, 0.0, -5.0], [x + 0.25, 0.25, -4.75], |_| true);
        lattice.body(Material::Elastic { young: 2e4, poisson: 0.3 }, 1000.0, &all, |_| [speed, 0.0, 0.0])
    };
    let mut w = world(vec![block(0.0, -1.0), block(0.5, 1.0)], lattice.dx, [-1.0, -1.0, -9.0], [1.0, 1.0, -4.0]);
    w.gravity = [0.0, 0.0, -9.81];
    let mut mpm = solver(&gpu, &w, "updated_lagrangian").unwrap();
    let frames: Vec<_> = (0..15).map(|_| mpm.frame(0.05).unwrap()).collect();
    let sum = |of: fn(&FrameStats) -> u32| frames.iter().map(of).sum::<u32>();
    assert_eq!((sum(|f| f.left), sum(|f| f.quarantined)), (512, 512), "{frames:?}");
    assert_eq!((sum(|f| f.rejected), sum(|f| f.gained)), (0, 0), "{frames:?}");
    assert!(frames.iter().all(|f| !f.unmended), "{frames:?}");
}

/// A particle that is not a number is no step's to mend: three attempts later the frame is kept without it, and said to be
/// kept so.
#[test]
fn what_cannot_be_mended_is_told() {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 16.0);
    let cube = lattice.fill([0.0; 3], [0.25; 3], |_| true);
    let mut jelly = lattice.body(Material::Elastic { young: 2e4, poisson: 0.3 }, 1000.0, &cube, |_| [0.0; 3]);
    jelly.velocities[100][0] = f32::NAN;
    let w = world(vec![jelly], lattice.dx, [-1.0; 3], [1.0; 3]);
    let mut mpm = solver(&gpu, &w, "updated_lagrangian").unwrap();
    let stats = mpm.frame(0.02).unwrap();
    assert!(stats.unmended && stats.rejected == 3 && stats.quarantined > 0 && stats.left == 0, "{stats:?}");
}

/// Drag that would overshoot in a step of the waves: the step follows the drag, and the block takes the wind's speed,
/// v = a (1 − exp(−k t)).
#[test]
fn strong_drag_shortens_the_step() {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 16.0);
    let cube = lattice.fill([0.0; 3], [0.25; 3], |_| true);
    let soft = lattice.body(Material::Elastic { young: 2e4, poisson: 0.3 }, 1000.0, &cube, |_| [0.0; 3]);
    let mut w = world(vec![soft], lattice.dx, [-1.0; 3], [1.5; 3]);
    let wind = |drag: f32| Field { kind: WIND, end: 1e9, p0: drag, a: [3.0, 0.0, 0.0, 0.0], ..Default::default() };
    let speed = |w: &mut World, drag: f32| {
        w.fields = vec![wind(drag)];
        let mut mpm = solver(&gpu, w, "updated_lagrangian").unwrap();
        let stats = mpm.frame(0.01).unwrap();
        let m = mpm.measure(0).unwrap();
        (m.momentum[0] / m.mass, stats)
    };
    let (strong, stats) = speed(&mut w, 5000.0);
    assert!((strong - 3.0).abs() < 1e-3 && faults(&[stats]) == 0, "{strong} m/s, {stats:?}");
    // Control: weak drag has hardly begun, and takes the steps of the waves.
    let (weak, slow) = speed(&mut w, 5.0);
    assert!((weak - 3.0 * (1.0 - (-0.05f64).exp())).abs() < 5e-3, "{weak} m/s");
    assert!(slow.substeps * 10 < stats.substeps, "{} and {} substeps", slow.substeps, stats.substeps);
}

/// A cloud that flies apart outgrows the room made for it: the frame is repeated with more, nothing is lost, and what
/// was outgrown is given back.
#[test]
fn a_cloud_that_flies_apart_finds_room() {
    let gpu = gpu();
    let lattice = Lattice::of_eight(1.0 / 16.0);
    let cloud = lattice.fill([-0.25; 3], [0.25; 3], |_| true);
    let dust = lattice.body(Material::Elastic { young: 1.0, poisson: 0.0 }, 1000.0, &cloud, |x| x.map(|c| 30.0 * c));
    let w = world(vec![dust], lattice.dx, [-4.0; 3], [4.0; 3]);
    let mut mpm = solver(&gpu, &w, "updated_lagrangian").unwrap();
    let before = gpu.buffers();
    let room = |all: &[(String, &str, u64)]| all.iter().find(|b| b.0 == "cells/rows").map(|b| b.2);
    for _ in 0..5 {
        assert_eq!(mpm.frame(0.05).unwrap().quarantined, 0);
    }
    let after = gpu.buffers();
    assert!(room(&after) > room(&before), "it never outgrew its room: this test tests nothing");
    assert_eq!(after.len(), before.len(), "buffers that were outgrown are still there");
    assert_eq!(mpm.measure(0).unwrap().quarantined, 0);
}

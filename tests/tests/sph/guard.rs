//! What the guard does: quarantine, frames taken back, the same bits on every run, nothing where there is nothing.

use physvideo::fluid::Fluid;
use physvideo::scene::Pressure;
use physvideo::stages::solver::{FrameStats, Solver};
use physvideo::stages::sph::Sph;
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::device::{self, gpu};
use physvideo_tests::folder;
use physvideo_tests::liquid::{lattice, liquid, room, world};
use physvideo_tests::stress;

const H: f64 = 0.02;

fn splash(pressure: Pressure) -> (Vec<u8>, u32) {
    let gpu = gpu();
    let mut body = liquid(1000.0, 1e-3, H, lattice(H, [0.0; 3], [5.0 * H, 5.0 * H, 8.0 * H]));
    body.velocities.fill([1.0, 0.3, -2.0]);
    let mut w = world(pressure, H, vec![body], [-0.1; 3], [0.5; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![room([0.0; 3], [10.0 * H, 5.0 * H, 1.0])];
    let mut sph = Sph::new(&gpu, &w).unwrap();
    let mut lost = 0;
    for _ in 0..4 {
        lost += sph.frame(0.02).unwrap().quarantined;
    }
    let particles = gpu.read(sph.particles).unwrap();
    let inside = |x: [f32; 3]| x[0] > -0.5 * H as f32 && x[0] < 10.5 * H as f32 && x[2] > -0.5 * H as f32;
    assert!(particles.iter().all(|p| inside(p.x)), "{pressure:?}: something left the room");
    (bytemuck::cast_slice(&particles).to_vec(), lost)
}

#[test]
fn two_runs_have_the_same_bits_and_nothing_leaves_the_room() {
    for pressure in [Pressure::Wcsph, Pressure::Dfsph] {
        let first = splash(pressure);
        assert_eq!(first.1, 0, "{pressure:?}: particles were lost");
        assert!(first == splash(pressure), "{pressure:?}: two runs differ");
    }
}

/// A particle that is not a number is taken out and counted; the others go on.
#[test]
fn a_bad_particle_is_taken_out() {
    let gpu = gpu();
    let mut body = liquid(1000.0, 1e-3, H, lattice(H, [0.0; 3], [4.0 * H; 3]));
    body.positions[7][1] = f32::NAN;
    let w = world(Pressure::Wcsph, H, vec![body], [-0.2; 3], [0.3; 3]);
    let mut sph = Sph::new(&gpu, &w).unwrap();
    let stats = sph.frame(0.01).unwrap();
    assert_eq!((stats.quarantined, stats.rejected), (1, 3));
    let m = sph.measure(0).unwrap();
    assert_eq!(m.quarantined, 1);
    assert!(m.speed.is_finite() && (m.mass - 63.0 * 1000.0 * H.powi(3)).abs() < 1e-6);
}

#[test]
fn an_empty_world_goes_by() {
    let gpu = gpu();
    let w = world(Pressure::Dfsph, H, vec![liquid(1000.0, 0.0, H, vec![])], [0.0; 3], [0.3; 3]);
    let mut sph = Sph::new(&gpu, &w).unwrap();
    assert_eq!(sph.frame(0.5).unwrap().substeps, 0);
    assert_eq!(sph.time(), 0.5);
}

/// A particle so fast that no step would end the frame: the frame is given up with its name, and nothing has moved.
#[test]
fn a_frame_without_an_end_is_given_up() {
    let gpu = gpu();
    let mut body = liquid(1000.0, 5e-3, 0.013, lattice(0.013, [0.0; 3], [0.065; 3]));
    body.velocities[17] = [0.0, 1e30, 0.0];
    let mut sph = Sph::new(&gpu, &world(Pressure::Wcsph, 0.013, vec![body], [-0.2; 3], [0.3; 3])).unwrap();
    let stats = sph.frame(0.05).unwrap();
    let fast = stats.stalled.expect("it never ends");
    assert_eq!((fast.particle, fast.body), (17, 0), "{stats:?}");
    assert_eq!(sph.time(), 0.0);
}

/// Frames of a block that hits the ground flat at 40 m/s: its energy over that at the start, and what was noticed.
fn hit(gpu: &Gpu) -> Vec<(f64, FrameStats)> {
    let mut w = stress::step::drop(stress::material_of("sph"), 1000.0, 40.0).world;
    w.fluid = Fluid { particle_size: 0.5 * w.dx, pressure: Pressure::Dfsph, ..Default::default() };
    let mut sph = Sph::new(gpu, &w).unwrap();
    let energy = |sph: &Sph| {
        let m = sph.measure(0).unwrap();
        m.kinetic + m.potential
    };
    let begun = energy(&sph);
    let frame = |_| {
        let stats = sph.frame(2e-3).unwrap();
        (energy(&sph) / begun, stats)
    };
    (0..4).map(frame).collect()
}

/// The block loses half of its energy. Where a solve mends all that is too dense at once, that becomes speed, half of the
/// energy again: such a frame is taken back, and goes well in steps half as long.
#[test]
fn a_gain_of_energy_is_taken_back() {
    let taken_back = |frames: &[(f64, FrameStats)]| -> u32 {
        assert!(frames.iter().all(|f| f.0 < 1.0) && frames[3].0 < 0.7, "{frames:?}");
        assert!(frames.iter().all(|f| f.1.clamped_velocity + f.1.quarantined == 0), "{frames:?}");
        assert!(frames.iter().all(|f| f.1.gained == f.1.rejected), "{frames:?}");
        frames.iter().map(|f| f.1.gained).sum()
    };
    assert_eq!(taken_back(&hit(&gpu())), 0);
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), "sph/source", "min(own.fill - 1.0, MENDED)", "own.fill - 1.0");
    let hasty = device::open(Options { wgsl: Some(copy.path().into()), validation: false, ..device::options() });
    assert!(taken_back(&hit(&hasty)) > 0);
}

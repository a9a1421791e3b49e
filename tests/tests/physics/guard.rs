//! The guard behind the step: a step that is too long blows a body up; the guard takes the frame back, goes on with
//! shorter ones, and remembers.

use physvideo::scene::Material;
use physvideo::stages::mpm::FrameStats;
use physvideo::world::{World, ground};
use physvideo_tests::device::gpu;

use super::setup::{body, fill, solver, world};

/// A jelly block that falls on the ground and rebounds, for six frames of 20 ms; the limit of its steps is a Courant
/// number of about 1.15 (a filled lattice in 3-D).
fn drop(change: impl Fn(&mut World)) -> (Vec<FrameStats>, f64) {
    let gpu = gpu();
    let dx = 1.0 / 16.0;
    let cube = fill(dx, [0.0, 0.0, 0.01], [0.25, 0.25, 0.26], |_| true);
    let jelly = body(Material::Elastic { young: 5e5, poisson: 0.3 }, 1000.0, dx, cube, |_| [0.0, 0.0, -1.0]);
    let mut w = world(vec![jelly], dx, [-1.0; 3], [1.5; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.3)];
    change(&mut w);
    let mut mpm = solver(&gpu, &w, true);
    let frames = (0..6).map(|_| mpm.frame(0.02).unwrap()).collect();
    let m = mpm.measure(0).unwrap();
    (frames, m.kinetic + m.elastic)
}

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
    // It fell with 1 m/s and 15.6 kg: 7.8 J and what the fall adds, and no blow-up may add more.
    assert!((guarded - energy).abs() < 0.15 * energy, "{guarded} J, {energy} J with short steps");
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
    assert!(!(blown < 1.15 * energy && blown > 0.85 * energy), "{blown} J, {energy} J with short steps");
}

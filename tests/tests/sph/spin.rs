//! A viscous ball that turns freely goes on turning: viscosity acts along the line of centres.

use physvideo::scene::{Pressure, Viscosity};
use physvideo::stages::solver::Measure;
use physvideo::stages::sph::Sph;
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::device;
use physvideo_tests::folder;
use physvideo_tests::liquid::{lattice, liquid, world};

const H: f64 = 0.013;
/// [rad/s]
const SPIN: f32 = 2.0;

/// A ball of radius 4 h, thick enough that what turns it apart, (ωR)²/ν, is 0.1/s; before and after 0.25 s.
fn turn(gpu: &Gpu, pressure: Pressure) -> [Measure; 2] {
    let mut positions = lattice(H, [-4.0 * H; 3], [4.0 * H; 3]);
    positions.retain(|x| x.iter().map(|c| c * c).sum::<f32>() < (4.0 * H as f32).powi(2));
    let mut body = liquid(1000.0, 0.1, H, positions);
    body.velocities = body.positions.iter().map(|x| [-SPIN * x[1], SPIN * x[0], 0.0]).collect();
    let mut w = world(pressure, H, vec![body], [-0.2; 3], [0.2; 3]);
    // Solved for with DFSPH, whose steps would be long, and not with WCSPH.
    w.fluid.viscosity = Viscosity::Auto;
    let mut sph = Sph::new(gpu, &w).unwrap();
    let before = sph.measure(0).unwrap();
    for _ in 0..5 {
        assert_eq!(sph.frame(0.05).unwrap().rejected, 0);
    }
    [before, sph.measure(0).unwrap()]
}

#[test]
fn a_viscous_ball_goes_on_turning() {
    for pressure in [Pressure::Wcsph, Pressure::Dfsph] {
        let [before, after] = turn(&device::gpu(), pressure);
        let kept = after.spin[2] / before.spin[2];
        // Each pair in f32, computed twice, over 1,200 steps.
        assert!((kept - 1.0).abs() < 2e-5, "{pressure:?}: {kept} of the angular momentum is left");
        // It widens by what turns it apart, and is slower by as much.
        let speed = (after.kinetic / before.kinetic).sqrt();
        assert!((0.95..1.001).contains(&speed), "{pressure:?}: {speed:.3} of the speed is left");
    }
}

/// Control: shear taken as a whole, as in Morris's form, stops the ball.
#[test]
fn the_whole_difference_of_velocities_stops_it() {
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    let (along, whole) = (
        "shear -= e * (rub(r * inv_h) * between(flow.w, other.w) * dot(flow.xyz - other.xyz, e));",
        "shear -= (flow.xyz - other.xyz) * (rub(r * inv_h) * between(flow.w, other.w) / 3.0);",
    );
    folder::edit(copy.path(), "sph/force", along, whole);
    let gpu = device::open(Options { wgsl: Some(copy.path().into()), validation: false, ..device::options() });
    let [before, after] = turn(&gpu, Pressure::Wcsph);
    let kept = after.spin[2] / before.spin[2];
    assert!(kept < 0.9, "{kept} of the angular momentum is left");
}

//! M5: a bar fixed at one end, started in its first axial mode; ω = (π/2L) sqrt(E/ρ).

use std::f64::consts::PI;

use physvideo::scene::Material;
use physvideo_tests::device::gpu;

use super::setup::{body, center, fill, plane, solver, world};

const LENGTH: f64 = 25.0;

/// Period [s] and loss of amplitude over one period of a bar of Young's modulus `young`, density 1.
fn vibrate(young: f32) -> (f64, f64) {
    let gpu = gpu();
    let dx = 0.5;
    let bar = fill(dx, [0.0; 3], [LENGTH, 1.0, 1.0], |_| true);
    let mode = |x: [f32; 3]| [(0.1 * (PI * f64::from(x[0]) / (2.0 * LENGTH)).sin()) as f32, 0.0, 0.0];
    let material = Material::Elastic { young, poisson: 0.0 };
    let mut w = world(vec![body(material, 1.0, dx, bar, mode)], dx, [-2.0; 3], [LENGTH + 2.0, 3.0, 3.0]);
    // The node plane x = 0 and those below it stand still: the wall is at x = 0.
    w.colliders = vec![plane([0.25 * dx, 0.0, 0.0], [1.0, 0.0, 0.0], true)];
    let mut mpm = solver(&gpu, &w, true);
    let rest = center(&gpu, &mpm)[0];
    let step = 0.05;
    let mut track = vec![0.0];
    for _ in 0..300 {
        mpm.frame(step as f32).unwrap();
        track.push(center(&gpu, &mpm)[0] - rest);
    }
    // Zero crossings by linear interpolation; the bar starts upwards through the first.
    let crossings: Vec<f64> = track
        .windows(2)
        .enumerate()
        .skip(1)
        .filter(|(_, w)| (w[0] > 0.0) != (w[1] > 0.0))
        .map(|(i, w)| step * (i as f64 + w[0] / (w[0] - w[1])))
        .collect();
    let peak = |from: f64| {
        let first = (from / step) as usize;
        track[first..].iter().take(100).fold(0.0, |m: f64, x| m.max(*x))
    };
    (crossings[1], 1.0 - peak(crossings[1]) / peak(0.0))
}

#[test]
fn a_bar_vibrates_at_its_frequency() {
    let (period, loss) = vibrate(100.0);
    println!("bar: period {period:.4} s of 10, amplitude loss {:.2} % a period", 100.0 * loss);
    // Goals: 0.1 % and 1 %.
    assert!((period / 10.0 - 1.0).abs() < 1e-3, "period {period} s, exact 10");
    assert!(loss.abs() < 1e-2, "loss {loss} a period");
}

/// Control: 1 % more stiffness is half a percent of period, which must show.
#[test]
fn a_stiffer_bar_is_told_apart() {
    let (period, _) = vibrate(101.0);
    assert!((period / 10.0 - 1.0).abs() > 3e-3, "period {period} s");
}

//! M5: a bar fixed at one end, started in its first axial mode; ω = (π/2L) sqrt(E/ρ), E 100, ρ 1, L 25, period 10 s. The
//! pins end at x = 0, and so does the clamp: the face is between cells, so that the mirror is exact.

use std::f64::consts::PI;

use physvideo_tests::device::gpu;

use super::setup::{body, center, fill, particles, solver, world};

const LENGTH: f64 = 25.0;
/// ω of E = 100 [1/s].
const OMEGA: f64 = 0.2 * PI;

/// Period [s] and loss of amplitude over two periods of a bar of Young's modulus `young` and some damping [s], with cells
/// of `dx`.
fn vibrate(young: f64, damping: f32, dx: f64) -> (f64, f64) {
    let gpu = gpu();
    let bar = fill(dx, [-2.0 * dx, 0.0, 0.0], [LENGTH, 2.0 * dx, 2.0 * dx], |_| true);
    let mode = |x: [f32; 3]| [(0.1 * (PI * f64::from(x[0]) / (2.0 * LENGTH)).sin()) as f32, 0.0, 0.0];
    let free: Vec<bool> = bar.iter().map(|x| x[0] > 0.0).collect();
    let mut b = body((young, 0.0), 1.0, dx, bar, mode);
    b.damping = damping;
    b.pinned = free.iter().map(|f| !f).collect();
    let mut solver = solver(&gpu, &world(vec![b], dx));
    let place = |s: &physvideo::stages::lagrangian::Lagrangian| center(&particles(&gpu, s), |i| free[i])[0];
    let rest = place(&solver);
    let step = 0.1;
    let mut track = vec![0.0];
    for _ in 0..240 {
        solver.frame(step as f32).unwrap();
        track.push(place(&solver) - rest);
    }
    // Zero crossings by linear interpolation; the bar starts upwards through the first.
    let crossings: Vec<f64> = track
        .windows(2)
        .enumerate()
        .skip(1)
        .filter(|(_, w)| (w[0] > 0.0) != (w[1] > 0.0))
        .map(|(i, w)| step * (i as f64 + w[0] / (w[0] - w[1])))
        .collect();
    // The turning point by a parabola through the three highest.
    let peak = |from: f64| {
        let first = (from / step) as usize;
        let at = (first + 1..first + 38).max_by(|a, b| track[*a].total_cmp(&track[*b])).unwrap();
        let (a, b, c) = (track[at - 1], track[at], track[at + 1]);
        b + (c - a).powi(2) / (8.0 * (2.0 * b - a - c))
    };
    (0.5 * crossings[3], 1.0 - peak(crossings[3]) / peak(0.0))
}

#[test]
fn a_bar_vibrates_at_its_frequency() {
    let (period, loss) = vibrate(100.0, 0.0, 1.0);
    println!("bar: period {period:.5} s of 10, amplitude loss {:.4} % in two periods", 100.0 * loss);
    // Goals: 0.1 % and 0.1 % a period.
    assert!((period / 10.0 - 1.0).abs() < 1e-3, "period {period} s, exact 10");
    assert!(loss.abs() < 2e-3, "loss {loss} in two periods");
}

/// Control: 1 % more stiffness is half a percent of period, which must show.
#[test]
fn a_stiffer_bar_is_told_apart() {
    let (period, _) = vibrate(101.0, 0.0, 1.0);
    assert!((period / 10.0 - 1.0).abs() > 3e-3, "period {period} s");
}

/// Stress that gains β times its rate takes ζ = β ω/2 of critical damping: amplitude falls by exp(−β ω² t/2).
#[test]
fn a_damped_bar_loses_what_it_should() {
    let exact = |damping: f64| 1.0 - (-damping * OMEGA * OMEGA * 20.0 / 2.0).exp();
    let loss = vibrate(100.0, 0.05, 1.0).1;
    println!("damped bar: amplitude loss {:.3} % in two periods, exact {:.3} %", 100.0 * loss, 100.0 * exact(0.05));
    // The bar's own loss is below 0.1 %, and the peaks of samples are found to as much.
    assert!((loss - exact(0.05)).abs() < 3e-3, "loss {loss}, exact {}", exact(0.05));
    // Control: a tenth more damping is told apart.
    assert!((vibrate(100.0, 0.055, 1.0).1 - exact(0.05)).abs() > 9e-3);
}

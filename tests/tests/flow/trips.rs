//! 7: inversion to the SDE's noise level and generation back. On N(μ, s²) every solver multiplies z − (1 − σ) μ by a
//! number, so a trip is one factor; 1 is exact.

use physvideo::scene::Solver;
use physvideo::stages::latent::LatentSetup;
use physvideo_tests::device;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::{SOLVERS, exact_flow};
use physvideo_tests::flow::run::{Lab, host_flow};
use physvideo_tests::flow::schedule::{framepack_shift, levels};

use super::{TAU, rounds};

/// Factors there and back, in f64, of 20 steps to level 20 of 25.
fn factors(solver: Solver, shift: f64, s2: f64) -> (f64, f64) {
    let up = levels(shift, 20, 25);
    let down: Vec<f64> = up.iter().rev().copied().collect();
    let data = Data::gaussian(0.0, s2.sqrt());
    let velocity = |sigma: f64, z: f64| data.velocity(z, sigma);
    (host_flow(&up, solver, 1.0, &velocity), host_flow(&down, solver, 1.0, &velocity))
}

#[test]
fn round_trips_have_the_written_factors() {
    for (shift, s2, written) in [
        (7.0, 1.0, [0.76656, 0.96959, 0.99854]),
        (7.0, 0.25, [0.61046, 0.85430, 0.97935]),
        (2.33, 1.0, [0.88294, 0.99536, 0.99984]),
    ] {
        for ((solver, name, _), written) in SOLVERS.into_iter().zip(written) {
            let (up, down) = factors(solver, shift, s2);
            rounds(&format!("{name}, shift {shift}, s² {s2}"), up * down, written, 5);
        }
    }
    let exact = exact_flow(0.0, TAU, 1.0);
    for ((solver, name, _), (up, down)) in
        SOLVERS.into_iter().zip([(0.87553, 0.87553), (0.94922, 1.02146), (1.01129, 0.98739)])
    {
        let (there, back) = factors(solver, 7.0, 1.0);
        rounds(&format!("{name}: inversion over exact"), there / exact, up, 5);
        rounds(&format!("{name}: generation over exact"), back * exact, down, 5);
    }
}

#[test]
fn round_trips_on_the_device_are_those_of_f64() {
    const NUMBERS: usize = 256;
    const MEAN: f64 = 0.6;
    let gpu = device::gpu();
    let start: Vec<f32> = (0..NUMBERS).map(|i| (i as f32 - 127.5) / 50.0).collect();
    for shift in [7.0, framepack_shift(2304)] {
        for s2 in [1.0, 0.25] {
            let data = Data::gaussian(MEAN, f64::sqrt(s2));
            let up = levels(shift, 20, 25);
            let down: Vec<f64> = up.iter().rev().copied().collect();
            for (solver, name, _) in SOLVERS {
                let setup = LatentSetup { elements: 256, cells: 16, history: true, ..Default::default() };
                let mut lab = Lab::new(&gpu, &setup).unwrap();
                lab.space.set(&start).unwrap();
                let velocity = |sigma: f64, z: &[f32], v: &mut [f32]| data.fast(sigma).fill(z, v);
                lab.flow(&up, solver, &velocity).unwrap();
                let middle = lab.space.get().unwrap();
                lab.flow(&down, solver, &velocity).unwrap();
                let back = lab.space.get().unwrap();
                let (there, home) = factors(solver, shift, s2);
                let rest = 1.0 - up[20];
                for ((z, m), b) in start.iter().zip(middle).zip(back) {
                    let off = f64::from(*z) - MEAN;
                    // 40 or 80 steps that each round a number below 4, and what they round grows at most fourfold.
                    let far = |found: f32, want: f64| (f64::from(found) - want).abs() < 2e-5;
                    assert!(far(m, rest * MEAN + there * off), "{name}, shift {shift}, s² {s2}: {m} inverted from {z}");
                    assert!(far(b, MEAN + there * home * off), "{name}, shift {shift}, s² {s2}: {b} back from {z}");
                }
            }
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

//! Algorithm 1 of the paper: what the program runs on the device against the paper's lines written out in f64, and what
//! happens when a run ends early.

mod network;
mod paper;
mod resume;
mod setup;
mod trouble;

use physvideo::scene::{Act, Sde, Solver, Start};
use physvideo_tests::device;
use setup::{Case, Field, run};

/// f32 arithmetic on numbers of size 1–4 over 50 steps, and the kernel's normals to 2e-6 through gains below 3.
const ROUNDING: f64 = 2e-4;

fn largest(a: &[f32], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (f64::from(*a) - b).abs()).fold(0.0, f64::max)
}

#[test]
fn every_way_of_running_is_the_papers_algorithm() {
    let gpu = device::gpu();
    for act in [Act::Animate, Act::Reconstruct] {
        for solver in [Solver::Euler, Solver::Ab2, Solver::Heun] {
            for start in [Start::Inversion, Start::Forward] {
                for (sde, beta) in [
                    (Sde::EulerMaruyama, None),
                    (Sde::EulerMaruyama, Some(0.3)),
                    (Sde::VarianceCorrected, None),
                    (Sde::LeimkuhlerMatthews, None),
                    (Sde::Exponential, None),
                ] {
                    let case = Case { act, solver, start, sde, beta, ..Case::default() };
                    let got = run(&gpu, &case, &mut Field::new(&case)).unwrap();
                    let want = paper::algorithm_1(&case);
                    let apart = largest(&got.latent, &want);
                    assert!(apart < ROUNDING, "{case:?}: {apart}");
                }
            }
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Weights between 0 and 1 scale γ cell by cell; β goes with both integrators that are linear in it.
#[test]
fn soft_masks_and_beta_are_the_papers_algorithm_too() {
    let gpu = device::gpu();
    for act in [Act::Animate, Act::Reconstruct] {
        for (sde, beta) in
            [(Sde::EulerMaruyama, None), (Sde::LeimkuhlerMatthews, None), (Sde::LeimkuhlerMatthews, Some(0.3))]
        {
            let case = Case { act, sde, beta, soft: true, ..Case::default() };
            let got = run(&gpu, &case, &mut Field::new(&case)).unwrap();
            let apart = largest(&got.latent, &paper::algorithm_1(&case));
            assert!(apart < ROUNDING, "{case:?}: {apart}");
            let hard = paper::algorithm_1(&Case { soft: false, ..case });
            assert!(largest(&got.latent, &hard) > 20.0 * ROUNDING);
        }
    }
}

/// The test above can fail: each of the paper's choices matters more than rounding.
#[test]
fn the_paper_told_otherwise_is_told_apart() {
    let gpu = device::gpu();
    let case = Case::default();
    let got = run(&gpu, &case, &mut Field::new(&case)).unwrap();
    for wrong in [
        Case { act: Act::Reconstruct, ..case.clone() },
        Case { sde: Sde::LeimkuhlerMatthews, ..case.clone() },
        Case { solver: Solver::Ab2, ..case.clone() },
        Case { start: Start::Forward, ..case.clone() },
        Case { gamma: 0.21, ..case.clone() },
        Case { iterations: 9, ..case.clone() },
        Case { seed: 8, ..case.clone() },
        Case { tau: 19, ..case.clone() },
    ] {
        let apart = largest(&got.latent, &paper::algorithm_1(&wrong));
        assert!(apart > 20.0 * ROUNDING, "{wrong:?} is only {apart} away");
    }
}

/// 20 evaluations of inversion at the step's start, 10 at τ, 20 of generation from τ down: 50 in all (paper, Sec. F).
#[test]
fn evaluations_come_in_the_papers_order() {
    let gpu = device::gpu();
    let case = Case::default();
    let mut field = Field::new(&case);
    let outcome = run(&gpu, &case, &mut field).unwrap();
    assert_eq!(outcome.nfe, [20, 10, 20]);
    let sigma = |i: usize| case.sigma(i);
    let want: Vec<f64> =
        (0..20).map(sigma).chain(std::iter::repeat_n(sigma(20), 10)).chain((1..=20).rev().map(sigma)).collect();
    assert_eq!(field.asked, want);
    assert_eq!(outcome.stats.len(), 11);
    let heun = Case { solver: Solver::Heun, ..case };
    assert_eq!(run(&gpu, &heun, &mut Field::new(&heun)).unwrap().nfe, [40, 10, 40]);
}

/// N = 0 is plain generation from the start latent (the paper's "SDE step = 0").
#[test]
fn no_iterations_are_plain_generation() {
    let gpu = device::gpu();
    let case = Case { iterations: 0, ..Case::default() };
    let got = run(&gpu, &case, &mut Field::new(&case)).unwrap();
    assert_eq!(got.nfe, [20, 0, 20]);
    assert!(largest(&got.latent, &paper::algorithm_1(&case)) < ROUNDING);
}

/// Guidance u + w (c − u) with two predictions; a scale of the inversion of its own.
#[test]
fn guidance_combines_two_predictions() {
    let gpu = device::gpu();
    let case = Case { guidance: Some(3.0), inversion_guidance: Some(1.5), ..Case::default() };
    let got = run(&gpu, &case, &mut Field::new(&case)).unwrap();
    assert!(largest(&got.latent, &paper::algorithm_1(&case)) < 3.0 * ROUNDING);
    // An evaluation is two calls of the network then.
    assert_eq!((got.nfe, got.calls), ([20, 10, 20], 100));
    let swapped = Case { guidance: Some(1.5), inversion_guidance: Some(3.0), ..case };
    assert!(largest(&got.latent, &paper::algorithm_1(&swapped)) > 20.0 * ROUNDING);
}

/// Networks that predict something else give the same latents.
#[test]
fn predictions_of_every_kind_lead_to_the_same_latents() {
    let gpu = device::gpu();
    for prediction in
        [physvideo_net::Prediction::EpsMinusX0, physvideo_net::Prediction::X0MinusEps, physvideo_net::Prediction::VpV]
    {
        for solver in [Solver::Euler, Solver::Ab2] {
            let case = Case { prediction, solver, ..Case::default() };
            let got = run(&gpu, &case, &mut Field::new(&case)).unwrap();
            let apart = largest(&got.latent, &paper::algorithm_1(&case));
            assert!(apart < 3.0 * ROUNDING, "{prediction:?} {solver:?}: {apart}");
        }
    }
}

/// A latent 0 that the model is given clean stays bit for bit, in every phase.
#[test]
fn a_held_first_latent_stays_as_it_is() {
    let gpu = device::gpu();
    for act in [Act::Animate, Act::Reconstruct] {
        let case = Case { act, held: true, ..Case::default() };
        let got = run(&gpu, &case, &mut Field::new(&case)).unwrap();
        let guide = case.guide();
        let (cells, first) = (case.cells(), case.height * case.width);
        let mut moved = 0;
        for (i, (got, was)) in got.latent.iter().zip(&guide.encoded).enumerate() {
            if i % cells < first {
                assert_eq!(got.to_bits(), was.to_bits(), "element {i}");
            } else {
                moved += usize::from(got != was);
            }
        }
        assert!(moved > got.latent.len() / 2);
        assert!(largest(&got.latent, &paper::algorithm_1(&case)) < ROUNDING);
    }
}

//! Networks that fail in the middle, and steps that are too large: what is said, and what is kept.

use physvideo::scene::Solver;
use physvideo_app::flow::{FlowError, Phase};
use physvideo_tests::device;

use super::setup::{Case, Field, Kept, Trouble, run, run_from};

#[test]
fn a_prediction_that_is_no_number_is_named_with_step_and_noise_level() {
    let gpu = device::gpu();
    for (number, place, sigma) in
        [(3, "step 3 of the inversion", 2), (24, "step 4 of the SDE", 20), (31, "step 1 of", 20)]
    {
        let case = Case::default();
        let mut field = Field { at: Some((number, Trouble::Nan)), ..Field::new(&case) };
        let mut kept = Kept::default();
        let error = run_from(&gpu, &case, &mut field, None, &mut kept).unwrap_err();
        let FlowError::NotFinite { count, first, sigma: level, .. } = &error else { panic!("{error}") };
        assert_eq!((*count, *first), (1, case.elements() / 2));
        assert!((level - case.sigma(sigma)).abs() < 1e-12);
        assert!(error.to_string().contains(place), "{error}");
        // What was finished before is kept, and it is numbers.
        let state = kept.stopped.unwrap();
        assert!(state.latent.iter().all(|x| x.is_finite()));
        assert_eq!(kept.steps.len(), number - 1);
    }
}

/// The half step of Heun's predictor is taken back.
#[test]
fn a_half_finished_step_is_not_kept() {
    let gpu = device::gpu();
    let case = Case { solver: Solver::Heun, ..Case::default() };
    // Evaluation 6 is the second of step 3.
    let mut field = Field { at: Some((6, Trouble::Interrupted)), ..Field::new(&case) };
    let mut kept = Kept::default();
    let error = run_from(&gpu, &case, &mut field, None, &mut kept).unwrap_err();
    assert!(matches!(error, FlowError::Interrupted { .. }), "{error}");
    let state = kept.stopped.unwrap();
    assert_eq!((state.phase, state.done), (Phase::Inversion, 2));
    let rest = run_from(&gpu, &case, &mut Field::new(&case), Some(&state), &mut Kept::default()).unwrap();
    assert_eq!(rest.latent, run(&gpu, &case, &mut Field::new(&case)).unwrap().latent);
}

/// Beyond 2S the variance grows without bound: with enough iterations f32 overflows and the run says why.
#[test]
fn a_step_size_beyond_the_limit_is_told() {
    let gpu = device::gpu();
    let case = Case { gamma: 9.0, iterations: 100, ..Case::default() };
    let error = run(&gpu, &case, &mut Field::new(&case)).unwrap_err();
    assert!(matches!(error, FlowError::Diverged { .. } | FlowError::NotFinite { .. }), "{error}");
    assert!(error.to_string().contains("gamma"), "{error}");
    let stable = Case { gamma: 1.8, iterations: 100, ..Case::default() };
    assert!(run(&gpu, &stable, &mut Field::new(&stable)).is_ok());
}

//! A run that was stopped after any step and goes on from what was kept has the same bits as one that was not.

use physvideo::scene::{Act, Sde, Solver};
use physvideo_app::flow::FlowError;
use physvideo_tests::device;

use super::setup::{Case, Field, Kept, run, run_from};

#[test]
fn a_stopped_run_goes_on_with_the_same_bits() {
    let gpu = device::gpu();
    for (solver, sde, act) in [
        (Solver::Euler, Sde::EulerMaruyama, Act::Animate),
        (Solver::Ab2, Sde::LeimkuhlerMatthews, Act::Reconstruct),
        (Solver::Heun, Sde::Exponential, Act::Animate),
    ] {
        let case = Case { solver, sde, act, tau: 5, iterations: 4, ..Case::default() };
        let whole = run(&gpu, &case, &mut Field::new(&case)).unwrap();
        let steps = 5 + 4 + 5;
        for until in 1..=steps {
            let mut kept = Kept { until: Some(until), ..Kept::default() };
            let ended = run_from(&gpu, &case, &mut Field::new(&case), None, &mut kept);
            assert!(matches!(ended, Err(FlowError::Interrupted { .. })));
            let state = kept.stopped.expect("a stopped run leaves its state");
            assert_eq!(Some(&(state.phase, state.done)), kept.steps.last());
            let mut field = Field::new(&case);
            let rest = run_from(&gpu, &case, &mut field, Some(&state), &mut Kept::default()).unwrap();
            let same = rest.latent.iter().zip(&whole.latent).all(|(a, b)| a.to_bits() == b.to_bits());
            assert!(same, "{solver:?}, {sde:?}: another result after stopping at step {until}");
            // What was done before is counted, and not done again.
            assert_eq!((rest.nfe, &rest.stats), (whole.nfe, &whole.stats));
            assert!(field.asked.len() < whole.nfe.iter().sum::<u32>() as usize);
        }
    }
}

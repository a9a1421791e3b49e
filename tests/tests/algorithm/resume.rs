//! A run that was stopped after any step and goes on from what was kept has the same bits as one that was not.

use physvideo::scene::{Act, Sde, Solver, Start};
use physvideo_app::flow::FlowError;
use physvideo_tests::device;

use super::setup::{Case, Field, Kept, run, run_from};

#[test]
fn a_stopped_run_goes_on_with_the_same_bits() {
    let gpu = device::gpu();
    let base = Case { tau: 5, iterations: 4, ..Case::default() };
    for case in [
        base.clone(),
        Case { solver: Solver::Ab2, sde: Sde::LeimkuhlerMatthews, act: Act::Reconstruct, ..base.clone() },
        Case { solver: Solver::Heun, sde: Sde::Exponential, held: true, ..base.clone() },
        Case { start: Start::Forward, beta: Some(0.3), ..base.clone() },
    ] {
        let (solver, sde) = (case.solver, case.sde);
        let whole = run(&gpu, &case, &mut Field::new(&case)).unwrap();
        let steps = if case.start == Start::Forward { 4 + 5 } else { 5 + 4 + 5 };
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

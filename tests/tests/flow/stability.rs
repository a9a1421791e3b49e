//! The limit 2τ²: above it the norm on point data grows without end, below it does not, whatever the data.

use physvideo::flow::{SdeError, SdeRule, stable_gamma};
use physvideo::scene::Sde;
use physvideo_tests::device;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::run::Lab;

use super::{CHAIN, START, TAU, rounds, rule};

/// Root of the mean square after so many iterations from 100.
fn end(sde: Sde, gamma: f64, data: &Data) -> f64 {
    let gpu = device::gpu();
    let mut lab = Lab::plain(&gpu, 1024).unwrap();
    lab.start(|_| 100.0, TAU, START).unwrap();
    let fast = data.fast(TAU);
    lab.sde(rule(sde, gamma, TAU), 200, CHAIN, &|z, v| fast.fill(z, v)).unwrap();
    lab.summary().unwrap().rms()
}

#[test]
fn steps_above_the_limit_diverge_and_those_below_do_not() {
    let limit = stable_gamma(TAU);
    rounds("2τ²", limit, 1.86445, 5);
    let point = Data::point(0.0);
    for sde in [Sde::EulerMaruyama, Sde::LeimkuhlerMatthews] {
        // |1 − γ/τ²| is 1.04 or 0.96: after 200 iterations 2,500 or 0.0003.
        assert!(end(sde, 1.02 * limit, &point) > 1e4, "{sde:?} above the limit");
        assert!(end(sde, 0.98 * limit, &point) < 20.0, "{sde:?} below the limit");
        assert!(end(sde, 0.98 * limit, &Data::two_points(TAU, 1.5, 0.5)) < 20.0, "{sde:?} on two points");
        assert!(end(sde, 0.98 * limit, &Data::gaussian(0.0, 1.0)) < 20.0, "{sde:?} on a Gaussian");
    }
    assert!(end(Sde::VarianceCorrected, limit, &point) < 200.0);
    for gamma in [1.02 * limit, 10.0, 1000.0] {
        assert!(end(Sde::Exponential, gamma, &point) < 2.0, "the exponential rule has no limit");
    }
    let refused = SdeRule::new(Sde::VarianceCorrected, 1.02 * limit, TAU, None, false);
    assert!(matches!(refused, Err(SdeError::Gamma { .. })));
}

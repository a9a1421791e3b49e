//! 5: networks that predict ε − x₀ must be negated. A wrong sign does not explode; only the mean shows it.

use physvideo::scene::Sde;
use physvideo::stages::latent::Reading;
use physvideo_tests::device;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::{self, Moments};
use physvideo_tests::flow::run::{Lab, PLAIN, Summary};

use super::{CHAIN, GAMMA, START, TAU, rounds, rule, within};

/// Numbers: the two means differ by 0.064, which is 20 standard errors.
const NUMBERS: usize = 1 << 17;

/// Mean after 10 iterations from mean 0 by the recursion; `sign` −1 is the wrong sign.
fn right(sign: f64, iterations: u32) -> Moments {
    let (at, slope) = laws::line(TAU, 1.0, 1.0);
    let rule = rule(Sde::EulerMaruyama, GAMMA, TAU);
    (0..iterations).fold(Moments::start(0.0, TAU * TAU), |m, n| m.step(rule.step(n), (sign * at, sign * slope), 0.0))
}

fn measured(scale: f64, predicts_noise: bool) -> Summary {
    let gpu = device::gpu();
    let mut lab = Lab::plain(&gpu, NUMBERS).unwrap();
    lab.start(|_| 0.0, TAU, START).unwrap();
    let fast = Data::gaussian(1.0, 1.0).fast(TAU);
    let velocity = |z: &[f32], v: &mut [f32]| {
        fast.fill(z, v);
        if predicts_noise {
            v.iter_mut().for_each(|v| *v = -*v);
        }
    };
    let rule = rule(Sde::EulerMaruyama, GAMMA, TAU);
    lab.chain((0..10).map(|n| rule.step(n)), Reading { scale, ..PLAIN }, CHAIN, &velocity, |_| {}).unwrap();
    assert_eq!(gpu.messages(), Vec::<String>::new());
    lab.summary().unwrap()
}

#[test]
fn a_wrong_sign_is_told_by_the_mean() {
    rounds("fixed point", right(1.0, 3000).mean, 0.034483, 6);
    rounds("flipped", right(-1.0, 3000).mean, -0.036939, 6);
    rounds("after 10", right(1.0, 10).mean, 0.03139, 5);
    rounds("flipped after 10", right(-1.0, 10).mean, -0.03297, 5);
    // Its rms is hardly wider.
    rounds("rms of the wrong sign [%]", 100.0 * (right(-1.0, 3000).rms() / right(1.0, 3000).rms() - 1.0), 3.1, 1);
    // A network of each convention, each read as it should be.
    for (scale, predicts_noise) in [(1.0, false), (-1.0, true)] {
        let s = measured(scale, predicts_noise);
        within("mean", s.mean, right(1.0, 10).mean, s.mean_error());
        within("variance", s.variance, right(1.0, 10).variance, s.variance_error());
    }
    // Control: a network of ε − x₀ that is not negated.
    let s = measured(1.0, true);
    within("flipped mean", s.mean, right(-1.0, 10).mean, s.mean_error());
    assert!((s.mean - right(1.0, 10).mean).abs() > 15.0 * s.mean_error(), "the control is not told apart: {}", s.mean);
}

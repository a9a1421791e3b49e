//! What holds in f64 without noise: the identity, the schedule, the table of stationary laws.

use physvideo::flow::{SdeRule, paper_beta, stable_gamma};
use physvideo::scene::Sde;
use physvideo_tests::flow::data::{Data, Mode};
use physvideo_tests::flow::laws::{self, Moments, RULES, spread};
use physvideo_tests::flow::schedule::{framepack_shift, levels, shifted};
use physvideo_tests::random::Random;

use super::{GAMMA, TAU, rounds, rule};

/// 1: the paper's update is z + γ ∇log p_τ + √2γ ε, for random data, z, v and τ.
#[test]
fn the_update_is_langevin_on_the_marginal() {
    let mut random = Random::new(1);
    let mut number = |low: f32, high: f32| f64::from(random.range(low, high));
    for _ in 0..1000 {
        let tau = number(0.05, 1.0);
        let modes = [0.3, 0.7].map(|weight| Mode { weight, mean: number(-3.0, 3.0), deviation: number(0.0, 2.0) });
        let (data, z, gamma) = (Data(modes.to_vec()), number(-3.0, 3.0), number(0.01, 1.0));
        let (score, v, e) = (data.score(z, tau), data.velocity(z, tau), number(-3.0, 3.0));
        let step = rule(Sde::EulerMaruyama, gamma, tau).step(5);
        let (ours, langevin) =
            (z + step.a * z + step.b * v + step.s0 * e, z + gamma * score + (2.0 * gamma).sqrt() * e);
        assert!((ours - langevin).abs() < 1e-12 * (1.0 + score.abs()), "{ours} {langevin}");
        // Any v: eq. (5) as printed.
        let v = number(-5.0, 5.0);
        let printed = (1.0 - gamma / tau) * z + (1.0 - tau) / tau * gamma * v + (2.0 * gamma).sqrt() * e;
        assert!((z + step.a * z + step.b * v + step.s0 * e - printed).abs() < 1e-12);
    }
}

/// 2: noise levels of shift 7 and of a small latent, and the β they give.
#[test]
fn the_schedule_gives_the_paper_s_noise_level() {
    let levels = levels(7.0, 25, 25);
    assert!((levels[20] - TAU).abs() < 1e-15 && (levels[1] - 7.0 / 31.0).abs() < 1e-15);
    assert_eq!((levels[0], levels[25]), (0.0, 1.0));
    rounds("paper's beta", paper_beta(levels[20]), 0.0357, 4);
    rounds("shift of 2304 tokens", framepack_shift(2304), 2.33186, 5);
    rounds("its level 20 of 25", shifted(framepack_shift(2304), 20, 25), 0.90317, 5);
    assert!(framepack_shift(8797) < 7.0 && (framepack_shift(8798) - 7.0).abs() < 1e-12);
}

/// 3 and the table "stationary variance error against S", all rows: the closed forms, and the chain by the engine's
/// coefficients, which must settle there.
#[test]
fn stationary_variances_are_those_of_the_table() {
    let s = spread(TAU, 1.0);
    rounds("S", s, 0.93341, 5);
    rounds("A", 1.0 - GAMMA / s, 0.78573, 5);
    rounds("variance", laws::settled_variance(Sde::EulerMaruyama, GAMMA, TAU, s), 1.04541, 5);
    // γ; EM at s 0, s 1, corrected, exponential at τ 28/29; EM, corrected, exponential at τ 0.8, s 1 [%].
    let table: [(f64, [f64; 7], i32); 6] = [
        (0.05, [2.7557, 2.7521, -0.0035, -0.0034, 3.8168, -0.2385, -0.2291], 4),
        (0.1, [5.6675, 5.6599, -0.0072, -0.0068, 7.9365, -0.4960, -0.4565], 4),
        (0.2, [12.0160, 11.9989, -0.0153, -0.0136, 17.2414, -1.0776, -0.9035], 4),
        (0.4, [27.3141, 27.2698, -0.0348, -0.0269, 41.6667, -2.6042, -1.7495], 4),
        (0.8, [75.1564, 74.9889, -0.0956, -0.0515, 142.8571, -8.9286, -3.1593], 4),
        (1.6, [605.04, 599.64, -0.7649, -0.0885, f64::NAN, f64::NAN, -4.7527], 2),
    ];
    use Sde::{EulerMaruyama as Em, Exponential as Exp, LeimkuhlerMatthews as Lm, VarianceCorrected as Corrected};
    let columns = [
        (Em, TAU, 0.0),
        (Em, TAU, 1.0),
        (Corrected, TAU, 1.0),
        (Exp, TAU, 1.0),
        (Em, 0.8, 1.0),
        (Corrected, 0.8, 1.0),
        (Exp, 0.8, 1.0),
    ];
    for (gamma, row, digits) in table {
        for ((sde, tau, s2), written) in columns.into_iter().zip(row) {
            let what = format!("{sde:?}, gamma {gamma}, tau {tau}, s² {s2}");
            if written.is_nan() {
                assert!(gamma > stable_gamma(tau) && (1.0 - gamma / spread(tau, s2)).abs() > 1.0, "{what}");
                continue;
            }
            let s = spread(tau, s2);
            let settled = laws::settled_variance(sde, gamma, tau, s);
            rounds(&what, 100.0 * (settled / s - 1.0), written, if written.abs() < 10.0 { 4 } else { digits });
            let chain = settle(rule(sde, gamma, tau), s2);
            assert!((chain / settled - 1.0).abs() < 1e-9, "{what}: {chain} {settled}");
        }
        for (tau, s2) in [(TAU, 0.0), (TAU, 1.0), (0.8, 1.0)] {
            let s = spread(tau, s2);
            if gamma < 2.0 * s {
                let chain = settle(rule(Lm, gamma, tau), s2);
                assert!((chain / s - 1.0).abs() < 1e-9, "Leimkuhler-Matthews, gamma {gamma}: {chain} {s}");
            }
        }
        if gamma <= stable_gamma(TAU) {
            for sde in [Corrected, Exp] {
                let chain = settle(rule(sde, gamma, TAU), 0.0);
                assert!((chain / (TAU * TAU) - 1.0).abs() < 1e-9, "{sde:?} is exact for a point: {chain}");
            }
        }
    }
}

/// Variance that the recursion of a rule's coefficients settles in.
fn settle(rule: SdeRule, s2: f64) -> f64 {
    let line = laws::line(rule.tau, 0.0, s2);
    (0..3000).fold(Moments::start(0.0, 1.0), |m, n| m.step(rule.step(n), line, 0.0)).variance
}

/// The recursion of the coefficients is the closed form of the paper's update, n by n.
#[test]
fn the_recursion_is_the_closed_form() {
    let (s, m) = (spread(TAU, 1.0), 0.7);
    let mut chain = Moments::start(-0.5, 0.2);
    for n in 1..=30 {
        chain = chain.step(rule(Sde::EulerMaruyama, GAMMA, TAU).step(n - 1), laws::line(TAU, m, 1.0), 0.0);
        let (mean, variance) = laws::euler_maruyama(GAMMA, s, (1.0 - TAU) * m, (-0.5, 0.2), n);
        assert!((chain.mean - mean).abs() < 1e-13 && (chain.variance - variance).abs() < 1e-13, "{chain:?}");
    }
    assert_eq!(RULES.len(), 4);
}

/// 6: for a point z + τ v is the point, at every noise level.
#[test]
fn point_data_are_predicted_exactly() {
    for mean in [-42.0, 0.0, 0.3, 7.0] {
        for tau in [0.1, 0.8, TAU, 1.0] {
            for z in [-3.0, 0.1, 2.0] {
                let clean = z + tau * Data::point(mean).velocity(z, tau);
                assert!((clean - mean).abs() < 1e-14 * (1.0 + mean.abs()), "{clean} {mean}");
            }
        }
    }
}

//! Two points, whose marginal has modes at ± 1.5 τ: what Gaussians do not show. Exact figures by quadrature.

use physvideo::scene::Sde;
use physvideo_tests::device;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::RULES;
use physvideo_tests::flow::run::Lab;
use physvideo_tests::flow::transfer::{Law, Transfer};

use super::{CHAIN, MANY, START, TAU, rounds, rule, within};

#[test]
fn two_modes_tell_the_integrators_apart() {
    let gpu = device::gpu();
    let data = Data::two_points(TAU, 1.5, 0.5);
    let (marginal, fast) = (Law::marginal(&data, TAU), data.fast(TAU));
    // Stationary variance error [%] at γ 0.1, 0.2, 0.4, in the order of RULES.
    let written: [[(f64, i32); 3]; 4] = [
        [(0.685, 3), (1.51, 2), (3.65, 2)],
        [(-1.76, 2), (-3.53, 2), (-7.14, 2)],
        [(-0.016, 3), (-0.053, 3), (-0.145, 3)],
        [(-1.67, 2), (-3.18, 2), (-5.78, 2)],
    ];
    let exact = data.variance(TAU);
    assert!((exact / (3.25 * TAU * TAU) - 1.0).abs() < 1e-12);
    for ((sde, name), row) in RULES.into_iter().zip(written) {
        for ((gamma, iterations), (figure, digits)) in [(0.1, 16), (0.2, 8), (0.4, 6)].into_iter().zip(row) {
            let rule = rule(sde, gamma, TAU);
            let transfer = Transfer::new(rule, &data);
            let settled = transfer.settled(&marginal);
            let off = 100.0 * (settled.variance() / exact - 1.0);
            rounds(&format!("{name}, gamma {gamma} [%]"), off, figure, digits);
            // On the device from the exact law, half of the numbers from each mode.
            let law = transfer.after(&marginal, iterations);
            let mut lab = Lab::plain(&gpu, MANY).unwrap();
            let mode = 1.5 * TAU;
            lab.start(|i| if i % 2 == 0 { -mode as f32 } else { mode as f32 }, TAU, START).unwrap();
            lab.sde(rule, iterations, CHAIN, &|z, v| fast.fill(z, v)).unwrap();
            let m = lab.summary().unwrap();
            let what = format!("{name}, gamma {gamma}");
            within(&format!("{what}: variance"), m.variance, law.variance(), m.variance_error());
            within(&format!("{what}: mean"), m.mean, law.mean(), m.mean_error());
            within(&format!("{what}: weight of the upper mode"), m.upper, law.upper(), m.upper_error());
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Order of the stationary law: halving γ halves the error of the others and quarters that of Leimkuhler–Matthews.
#[test]
fn only_leimkuhler_and_matthews_is_of_second_order() {
    let data = Data::two_points(TAU, 1.5, 0.5);
    let (marginal, exact) = (Law::marginal(&data, TAU), data.variance(TAU));
    for (sde, name) in RULES {
        let error =
            |gamma: f64| Transfer::new(rule(sde, gamma, TAU), &data).settled(&marginal).variance() / exact - 1.0;
        let order = (error(0.1) / error(0.05)).log2();
        let want = if sde == Sde::LeimkuhlerMatthews { 2.0 } else { 1.0 };
        assert!((order - want).abs() < 0.25, "{name}: order {order}");
    }
}

/// Modes of weight 0.3 and 0.7, begun in one of them: how much has come over is that of the quadrature.
#[test]
fn mode_weights_come_over_as_by_quadrature() {
    let gpu = device::gpu();
    let data = Data::two_points(TAU, 1.5, 0.3);
    let fast = data.fast(TAU);
    let mode = 1.5 * TAU;
    let start = Law::new(|z| physvideo_tests::flow::data::normal(z, mode, TAU * TAU));
    for (sde, name) in RULES {
        let rule = rule(sde, 0.2, TAU);
        let law = Transfer::new(rule, &data).after(&start, 10);
        let mut lab = Lab::plain(&gpu, MANY).unwrap();
        lab.start(|_| mode as f32, TAU, START).unwrap();
        lab.sde(rule, 10, CHAIN, &|z, v| fast.fill(z, v)).unwrap();
        let m = lab.summary().unwrap();
        within(&format!("{name}: weight"), m.upper, law.upper(), m.upper_error());
        within(&format!("{name}: mean"), m.mean, law.mean(), m.mean_error());
        within(&format!("{name}: variance"), m.variance, law.variance(), m.variance_error());
        assert!(m.upper > 0.35 && m.upper < 0.9, "{name}: {}", m.upper);
    }
    rounds("where it goes", Law::marginal(&data, TAU).upper(), 0.3 * 0.933_19 + 0.7 * 0.066_81, 4);
}

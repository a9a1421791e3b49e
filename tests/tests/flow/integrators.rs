//! 3 and 4 on the device: mean and variance of every integrator against the recursion of f64, and number by number
//! against the host with the same noise.

use physvideo::flow::{SdeRule, SdeStep};
use physvideo::scene::Sde;
use physvideo_gpu::Gpu;
use physvideo_tests::device;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::{self, Moments, RULES, spread};
use physvideo_tests::flow::noise::normals;
use physvideo_tests::flow::run::{Lab, PLAIN, Summary, host_sde};

use super::{CHAIN, GAMMA, MANY, START, TAU, rounds, rule, within};

fn measured(gpu: &Gpu, rule: SdeRule, data: &Data, start: (f64, f64), iterations: u32, numbers: usize) -> Summary {
    let mut lab = Lab::plain(gpu, numbers).unwrap();
    lab.start(|_| start.0 as f32, start.1.sqrt(), START).unwrap();
    let fast = data.fast(rule.tau);
    lab.sde(rule, iterations, CHAIN, &|z, v| fast.fill(z, v)).unwrap();
    lab.summary().unwrap()
}

fn right(rule: SdeRule, (mean, s2): (f64, f64), start: (f64, f64), iterations: u32) -> Moments {
    let line = laws::line(rule.tau, mean, s2);
    (0..iterations).fold(Moments::start(start.0, start.1), |m, n| m.step(rule.step(n), line, 0.0))
}

/// Number by number: f32 on the device against f64 with the same noise, for every integrator.
#[test]
fn every_integrator_is_its_f64_twin_number_by_number() {
    const NUMBERS: usize = 1 << 14;
    let gpu = device::gpu();
    let data = Data::gaussian(0.7, 0.9);
    let (at, slope) = laws::line(TAU, 0.7, 0.81);
    for (sde, name) in RULES {
        let rule = rule(sde, GAMMA, TAU);
        let mut lab = Lab::plain(&gpu, NUMBERS).unwrap();
        lab.start(|i| (i % 7) as f32 * 0.25 - 0.75, TAU, START).unwrap();
        let mut host: Vec<f64> = normals(START, 0, NUMBERS);
        host.iter_mut().enumerate().for_each(|(i, z)| *z = (i % 7) as f64 * 0.25 - 0.75 + TAU * *z);
        lab.sde(rule, 10, CHAIN, &|z, v| data.fast(TAU).fill(z, v)).unwrap();
        host_sde((0..10).map(|n| rule.step(n)), &mut host, CHAIN, &|z| at + slope * z, 0.0, &|_| 1.0);
        // Noise up to 6.8 with 24 bits, ten times, of which the drift forgets a fifth each time.
        let far =
            lab.space.get().unwrap().iter().zip(&host).fold(0.0, |m: f64, (z, h)| m.max((f64::from(*z) - h).abs()));
        assert!(far < 1e-5, "{name}: {far:e}");
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// 4: root of the mean square over τ after 10 iterations on point data, the paper's figure of norms.
#[test]
fn norms_after_ten_iterations_grow_as_they_must() {
    let gpu = device::gpu();
    // γ and rms over τ − 1 [%].
    let written: [(f64, f64, i32); 8] = [
        (0.05, 0.92, 2),
        (0.1, 2.51, 2),
        (0.2, 5.79, 2),
        (0.4, 12.83, 2),
        (0.8, 32.35, 2),
        (1.6, 165.38, 2),
        (1.8, 372.0, 0),
        (1.9, 678.0, 0),
    ];
    for (gamma, figure, digits) in written {
        let rule = rule(Sde::EulerMaruyama, gamma, TAU);
        let exact = right(rule, (0.0, 0.0), (0.0, TAU * TAU), 10);
        let closed = laws::euler_maruyama(gamma, TAU * TAU, 0.0, (0.0, TAU * TAU), 10).1;
        assert!((exact.variance / closed - 1.0).abs() < 1e-12);
        rounds(&format!("rms at gamma {gamma}"), 100.0 * (exact.rms() / TAU - 1.0), figure, digits);
        let mut lab = Lab::plain(&gpu, MANY).unwrap();
        lab.start(|_| 0.0, TAU, START).unwrap();
        let fast = Data::point(0.0).fast(TAU);
        let mut last = 0.0;
        let steps = (0..10).map(|n| rule.step(n));
        lab.chain(steps, PLAIN, CHAIN, &|z, v| fast.fill(z, v), |s| last = s.rms).unwrap();
        // A root of a mean square of n Gaussians has a relative standard error of 1/√2n.
        within(&format!("rms at gamma {gamma}"), last, exact.rms(), exact.rms() / (2.0 * MANY as f64).sqrt());
        let all = lab.summary().unwrap();
        // The device's sums against f64: pairwise from 32 numbers on.
        assert!((all.rms() / last - 1.0).abs() < 1e-6, "{} {last}", all.rms());
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// The table's rows with large steps on the device: from S, long enough to settle to less than a standard error.
#[test]
fn stationary_variances_on_the_device() {
    use Sde::{EulerMaruyama as Em, Exponential as Exp, LeimkuhlerMatthews as Lm, VarianceCorrected as Corrected};
    let gpu = device::gpu();
    let cases: [(Sde, f64, f64, f64, u32); 11] = [
        (Em, 0.2, TAU, 1.0, 16),
        (Em, 0.8, TAU, 0.0, 6),
        (Em, 1.6, TAU, 1.0, 12),
        (Em, 0.4, 0.8, 1.0, 6),
        (Corrected, 0.8, TAU, 1.0, 6),
        (Corrected, 0.8, 0.8, 1.0, 6),
        (Exp, 0.8, 0.8, 1.0, 6),
        (Exp, 1.6, 0.8, 1.0, 6),
        (Lm, 0.2, TAU, 1.0, 16),
        (Lm, 0.8, TAU, 1.0, 6),
        (Lm, 0.8, 0.8, 1.0, 6),
    ];
    for (sde, gamma, tau, s2, iterations) in cases {
        let (rule, s) = (rule(sde, gamma, tau), spread(tau, s2));
        let what = format!("{sde:?}, gamma {gamma}, tau {tau}, s² {s2}");
        let m = measured(&gpu, rule, &Data::gaussian(0.5, s2.sqrt()), ((1.0 - tau) * 0.5, s), iterations, MANY);
        let exact = right(rule, (0.5, s2), ((1.0 - tau) * 0.5, s), iterations);
        within(&what, m.variance, exact.variance, m.variance_error());
        within(&what, m.mean, (1.0 - tau) * 0.5, m.mean_error());
        let settled = laws::settled_variance(sde, gamma, tau, s);
        let left = (exact.variance / settled - 1.0).abs();
        assert!(left < 2e-3 || gamma == 1.6, "{what}: not settled, {left}");
        // Controls: what is not exact is told from S.
        if (settled / s - 1.0).abs() > 0.01 {
            assert!((m.variance - s).abs() > 8.0 * m.variance_error(), "{what} is not told from S");
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Leimkuhler–Matthews has no noise before its first step; begun with its share alone it is a sixth short.
#[test]
fn the_first_step_of_leimkuhler_and_matthews_is_whole() {
    let gpu = device::gpu();
    let (rule, s) = (rule(Sde::LeimkuhlerMatthews, GAMMA, TAU), spread(TAU, 1.0));
    let naive = SdeStep { s0: rule.step(1).s0, ..rule.step(0) };
    let line = laws::line(TAU, 0.0, 1.0);
    for (step, short) in [(rule.step(0), 100.0 * (1.0 - 0.97634 / 0.93341)), (naive, 16.8)] {
        let exact = Moments::start(0.0, s).step(step, line, 0.0);
        rounds("short after the first step [%]", 100.0 * (1.0 - exact.variance / s), short, 1);
        let mut lab = Lab::plain(&gpu, MANY).unwrap();
        lab.start(|_| 0.0, s.sqrt(), START).unwrap();
        let fast = Data::gaussian(0.0, 1.0).fast(TAU);
        lab.chain([step], PLAIN, CHAIN, &|z, v| fast.fill(z, v), |_| {}).unwrap();
        let m = lab.summary().unwrap();
        within("variance after the first step", m.variance, exact.variance, m.variance_error());
    }
    // From the second step on the variance that is missing or too much is forgotten as A²ⁿ.
    let begun = right(rule, (0.0, 1.0), (0.0, s), 40).variance;
    assert!((begun / s - 1.0).abs() < 1e-6, "{begun} {s}");
}

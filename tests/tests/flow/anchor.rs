//! A β that is not the paper's, with the encoded latent as anchor (eq. general_sde).

use physvideo::flow::{SdeRule, paper_beta};
use physvideo::scene::Sde;
use physvideo::stages::latent::LatentSetup;
use physvideo_tests::device;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::{self, Moments};
use physvideo_tests::flow::run::Lab;

use super::{CHAIN, GAMMA, START, TAU, rounds, within};

const NUMBERS: usize = 1 << 18;
const MEAN: f64 = 2.0;
const ANCHOR: f64 = -1.0;

fn rule(sde: Sde, beta: f64) -> SdeRule {
    SdeRule::new(sde, GAMMA, TAU, Some(beta), false).unwrap()
}

fn after(rule: SdeRule, iterations: u32) -> Moments {
    let line = laws::line(TAU, MEAN, 1.0);
    (0..iterations).fold(Moments::start(0.0, TAU * TAU), |m, n| m.step(rule.step(n), line, ANCHOR))
}

/// Mean and variance that a β settles in, by λ, and the recursion; and on the device after 12 iterations.
#[test]
fn beta_shifts_mean_and_variance_as_lambda_says() {
    let gpu = device::gpu();
    let anchor = vec![ANCHOR as f32; NUMBERS];
    let fast = Data::gaussian(MEAN, 1.0).fast(TAU);
    // The paper's own figure has 1e-6, 0.0357, 1.28 and 2.58.
    for beta in [1e-6, paper_beta(TAU), 1.28, 2.58, 10.0] {
        let law = laws::anchored(GAMMA, TAU, beta, (MEAN, 1.0), ANCHOR);
        let settled = after(rule(Sde::EulerMaruyama, beta), 3000);
        assert!((settled.mean - law.mean).abs() < 1e-9, "beta {beta}: {} {}", settled.mean, law.mean);
        assert!(
            (settled.variance / law.variance - 1.0).abs() < 1e-9,
            "beta {beta}: {} {}",
            settled.variance,
            law.variance
        );
        // Leimkuhler and Matthews have 1/λ itself.
        let exact = after(rule(Sde::LeimkuhlerMatthews, beta), 3000);
        assert!((exact.variance * law.rate - 1.0).abs() < 1e-9, "beta {beta}: {} {}", exact.variance, 1.0 / law.rate);
        for sde in [Sde::EulerMaruyama, Sde::LeimkuhlerMatthews] {
            let rule = rule(sde, beta);
            let setup = LatentSetup {
                elements: NUMBERS as u64,
                cells: NUMBERS as u64 / 16,
                anchor: Some(&anchor),
                ..Default::default()
            };
            let mut lab = Lab::new(&gpu, &setup).unwrap();
            lab.start(|_| 0.0, TAU, START).unwrap();
            lab.sde(rule, 12, CHAIN, &|z, v| fast.fill(z, v)).unwrap();
            let (m, want) = (lab.summary().unwrap(), after(rule, 12));
            within(&format!("{sde:?}, beta {beta}, mean"), m.mean, want.mean, m.mean_error());
            within(&format!("{sde:?}, beta {beta}, variance"), m.variance, want.variance, m.variance_error());
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// The paper's β leaves the anchor out: μ is a quarter of a million and not seen.
#[test]
fn the_paper_s_beta_does_not_see_the_anchor() {
    let gpu = device::gpu();
    let anchor = vec![2.5e5; 4096];
    let setup = LatentSetup { elements: 4096, cells: 256, anchor: Some(&anchor), ..Default::default() };
    let fast = Data::gaussian(MEAN, 1.0).fast(TAU);
    let run = |setup: &LatentSetup, beta: Option<f64>| {
        let mut lab = Lab::new(&gpu, setup).unwrap();
        lab.start(|_| 0.0, TAU, START).unwrap();
        let rule = SdeRule::new(Sde::EulerMaruyama, GAMMA, TAU, beta, false).unwrap();
        lab.sde(rule, 5, CHAIN, &|z, v| fast.fill(z, v)).unwrap();
        lab.space.get().unwrap()
    };
    let plain = LatentSetup { elements: 4096, cells: 256, ..Default::default() };
    assert_eq!(run(&setup, Some(paper_beta(TAU))), run(&plain, None));
}

/// Above S/(τ (1 − τ) s²) nothing returns.
#[test]
fn beta_has_a_limit() {
    let law = laws::anchored(GAMMA, TAU, 1.0, (0.0, 1.0), 0.0);
    rounds("largest beta", law.limit, 28.04, 2);
    for (factor, stays) in [(0.9, true), (1.1, false)] {
        let beta = factor * law.limit;
        assert_eq!(laws::anchored(GAMMA, TAU, beta, (0.0, 1.0), 0.0).rate > 0.0, stays);
        let rule = rule(Sde::EulerMaruyama, beta);
        let line = laws::line(TAU, 0.0, 1.0);
        let m = (0..2000).fold(Moments::start(1.0, 1.0), |m, n| m.step(rule.step(n), line, 0.0));
        assert_eq!(m.mean.abs() < 1.0, stays, "beta {beta}: {m:?}");
        // On the device, from far away so that the noise does not matter.
        let gpu = device::gpu();
        let anchor = [0.0; 1024];
        let setup = LatentSetup { elements: 1024, cells: 64, anchor: Some(&anchor), ..Default::default() };
        let mut lab = Lab::new(&gpu, &setup).unwrap();
        lab.start(|_| 1e4, 1.0, START).unwrap();
        let fast = Data::gaussian(0.0, 1.0).fast(TAU);
        lab.sde(rule, 50, CHAIN, &|z, v| fast.fill(z, v)).unwrap();
        assert_eq!(lab.summary().unwrap().mean < 1e4, stays, "beta {beta}");
    }
}

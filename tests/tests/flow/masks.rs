//! 8: what a mask keeps, keeps its bits; what it updates is as without a mask. Soft masks scale the step, not the
//! noise's result.

use physvideo::flow::{SdeRule, SdeStep};
use physvideo::scene::Sde;
use physvideo::stages::latent::LatentSetup;
use physvideo_tests::device;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::{self, Moments, RULES, spread};
use physvideo_tests::flow::run::{Lab, PLAIN, Summary};
use physvideo_tests::random::Random;

use super::{CHAIN, GAMMA, MANY, START, TAU, rounds, rule, within};

const CELLS: usize = 1022;
const NUMBERS: usize = 16 * CELLS;

fn bits(z: &[f32]) -> Vec<u32> {
    z.iter().map(|z| z.to_bits()).collect()
}

/// Both acts (line 12 of Algorithm 1), with M mixed, 0 and 1, after 10 iterations of every integrator.
#[test]
fn cells_that_are_kept_keep_their_bits() {
    let gpu = device::gpu();
    let mut random = Random::new(8);
    let mixed: Vec<f32> = (0..CELLS).map(|_| f32::from(u8::from(random.chance(0.4)))).collect();
    let setup = LatentSetup { elements: NUMBERS as u64, cells: CELLS as u64, ..Default::default() };
    let fast = Data::gaussian(0.4, 1.0).fast(TAU);
    let velocity = |z: &[f32], v: &mut [f32]| fast.fill(z, v);
    for (sde, name) in RULES {
        let rule = rule(sde, GAMMA, TAU);
        let run = |update: &[f32]| {
            let mut lab = Lab::new(&gpu, &setup).unwrap();
            lab.start(|i| (i % 5) as f32 - 2.0, TAU, START).unwrap();
            let before = bits(&lab.space.get().unwrap());
            lab.space.update_where(update).unwrap();
            lab.sde(rule, 10, CHAIN, &velocity).unwrap();
            (before, bits(&lab.space.get().unwrap()))
        };
        let (_, everywhere) = run(&[1.0; CELLS]);
        for (mask, what) in [(mixed.clone(), "mixed"), (vec![0.0; CELLS], "M = 0"), (vec![1.0; CELLS], "M = 1")] {
            // Act reconstruct keeps M and updates 1 − M; act animate the other way round.
            for update in [mask.iter().map(|m| 1.0 - m).collect::<Vec<f32>>(), mask.clone()] {
                let (before, after) = run(&update);
                for i in 0..NUMBERS {
                    let want = if update[i % CELLS] == 0.0 { before[i] } else { everywhere[i] };
                    assert_eq!(after[i], want, "{name}, {what}: number {i}");
                }
            }
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Lines 6–8: where M is 1 the inverted latent stays, elsewhere it is the base brought to noise level τ.
#[test]
fn the_start_mixes_what_is_known_with_noise() {
    const EACH: usize = MANY / 16;
    let gpu = device::gpu();
    let mut random = Random::new(9);
    let masks =
        [vec![0.0; EACH], vec![1.0; EACH], (0..EACH).map(|_| f32::from(u8::from(random.chance(0.5)))).collect()];
    let base = vec![3.0; MANY];
    for mask in masks {
        let mut lab = Lab::plain(&gpu, MANY).unwrap();
        lab.start(|i| i as f32, 0.0, START).unwrap();
        lab.space.mix(&base, Some(&mask), TAU, CHAIN).unwrap();
        let z = lab.space.get().unwrap();
        let kept = |i: usize| mask[i % EACH] == 1.0;
        assert!((0..MANY).all(|i| !kept(i) || z[i] == i as f32));
        let fresh: Vec<f32> = (0..MANY).filter(|i| !kept(*i)).map(|i| z[i]).collect();
        if !fresh.is_empty() {
            let s = Summary::of(&fresh);
            within("mean of the forward sample", s.mean, (1.0 - TAU) * 3.0, s.mean_error());
            within("variance of the forward sample", s.variance, TAU * TAU, s.variance_error());
        }
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Steps of the flow hold cells too, and leave their bits.
#[test]
fn cells_held_in_the_flow_keep_their_bits() {
    let gpu = device::gpu();
    let free: Vec<f32> = (0..CELLS).map(|c| f32::from(u8::from(c % 3 != 0))).collect();
    let setup = LatentSetup {
        elements: NUMBERS as u64,
        cells: CELLS as u64,
        free: Some(&free),
        history: true,
        ..Default::default()
    };
    let mut lab = Lab::new(&gpu, &setup).unwrap();
    lab.start(|i| (i % 5) as f32 - 2.0, 1.0, START).unwrap();
    let before = lab.space.get().unwrap();
    let levels = physvideo_tests::flow::schedule::levels(7.0, 20, 25);
    let velocity = |sigma: f64, z: &[f32], v: &mut [f32]| Data::gaussian(0.0, 1.0).fast(sigma).fill(z, v);
    lab.flow(&levels, physvideo::scene::Solver::Ab2, &velocity).unwrap();
    let after = lab.space.get().unwrap();
    for i in 0..NUMBERS {
        let held = free[i % CELLS] == 0.0;
        assert_eq!(before[i].to_bits() == after[i].to_bits(), held, "number {i}");
    }
}

/// A weight d makes a step of γ d, so the variance is that of the smaller step. Scaling what a step adds by d instead
/// scales the noise wrongly: about half the variance at d = 0.5.
#[test]
fn soft_masks_keep_the_variance() {
    const ITERATIONS: u32 = 24;
    let gpu = device::gpu();
    let s = spread(TAU, 1.0);
    let line = laws::line(TAU, 0.0, 1.0);
    let fast = Data::gaussian(0.0, 1.0).fast(TAU);
    let cells = MANY / 16;
    let setup = LatentSetup { elements: MANY as u64, cells: cells as u64, ..Default::default() };
    let weights = [0.25, 0.5, 0.75, 1.0];
    // Long runs of cells with the same weight, so that a channel holds all of them.
    let update: Vec<f32> = (0..cells).map(|c| weights[c * weights.len() / cells] as f32).collect();
    let after = |rule: SdeRule| (0..ITERATIONS).fold(Moments::start(0.0, s), |m, n| m.step(rule.step(n), line, 0.0));
    for sde in [Sde::EulerMaruyama, Sde::LeimkuhlerMatthews] {
        let soft = SdeRule::new(sde, GAMMA, TAU, None, true).unwrap();
        let mut lab = Lab::new(&gpu, &setup).unwrap();
        lab.start(|_| 0.0, s.sqrt(), START).unwrap();
        lab.space.update_where(&update).unwrap();
        lab.sde(soft, ITERATIONS, CHAIN, &|z, v| fast.fill(z, v)).unwrap();
        let z = lab.space.get().unwrap();
        for (k, d) in weights.into_iter().enumerate() {
            let part: Vec<f32> = (0..MANY).filter(|i| (i % cells) * weights.len() / cells == k).map(|i| z[i]).collect();
            let m = Summary::of(&part);
            within(
                &format!("{sde:?}, weight {d}"),
                m.variance,
                after(rule(sde, GAMMA * d, TAU)).variance,
                m.variance_error(),
            );
        }
    }
    // Control.
    let whole = rule(Sde::EulerMaruyama, GAMMA, TAU).step(0);
    let naive = SdeStep { a: 0.5 * whole.a, b: 0.5 * whole.b, m: 0.0, s0: 0.5 * whole.s0, s1: 0.0 };
    let settled = (0..3000).fold(Moments::start(0.0, s), |m, _| m.step(naive, line, 0.0)).variance;
    rounds("naive fractional mask over S", settled / s, 0.53, 2);
    let mut lab = Lab::new(&gpu, &setup).unwrap();
    lab.start(|_| 0.0, s.sqrt(), START).unwrap();
    lab.chain([naive; ITERATIONS as usize], PLAIN, CHAIN, &|z, v| fast.fill(z, v), |_| {}).unwrap();
    let m = lab.summary().unwrap();
    let exact = (0..ITERATIONS).fold(Moments::start(0.0, s), |m, _| m.step(naive, line, 0.0));
    within("naive fractional mask", m.variance, exact.variance, m.variance_error());
    assert!(m.variance < 0.55 * s, "the control is not told apart");
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

//! The paper's Algorithm 1 in f64, line by line, and the integrators of the design beside the paper's own. Shares
//! nothing with the program but the noise, which is defined by its counter.

use physvideo::scene::{Act, Sde, Solver, Start};
use physvideo_net::Branch;
use physvideo_tests::proof::latent::normals;

use super::setup::Case;

pub fn algorithm_1(case: &Case) -> Vec<f64> {
    let guide = case.guide();
    let n = case.elements();
    let wide = |numbers: &[f32]| -> Vec<f64> { numbers.iter().map(|x| f64::from(*x)).collect() };
    // Line 1 is the encoder's.
    let (z, z_bg) = (wide(&guide.encoded), wide(&guide.background));
    let m = |i: usize| f64::from(guide.mask[i % case.cells()]);
    let held = |i: usize| guide.held.as_ref().is_some_and(|h| h[i % case.cells()] == 1.0);
    let sigma = |t: usize| case.sigma(t);
    let tau = sigma(case.tau);
    let noise = |which: u32, iteration: u32, i: usize| {
        normals([case.seed as u32, (case.seed >> 32) as u32], 2 * 3 + which, iteration, (i / 4) as u32)[i % 4]
    };

    // Lines 2–5.
    let mut inverted = z.clone();
    if case.start == Start::Inversion {
        let levels: Vec<f64> = (0..=case.tau).map(sigma).collect();
        walk(case, &mut inverted, &levels, case.inversion_guidance, &held);
    }
    // Lines 6–8.
    let mut now: Vec<f64> = (0..n)
        .map(|i| {
            let base = if case.act == Act::Animate && case.start == Start::Inversion { z_bg[i] } else { z[i] };
            let noisy = (1.0 - tau) * base + tau * noise(0, 0, i);
            match case.start {
                _ if held(i) => z[i],
                // A soft mask takes the larger side here: a mixture of two independent noises would be too narrow.
                Start::Inversion if m(i) >= 0.5 => inverted[i],
                Start::Inversion => noisy,
                Start::Forward => noisy,
            }
        })
        .collect();
    // Lines 9–13.
    for k in 0..case.iterations {
        let v = velocity(case, &now, tau, case.guidance);
        // γ d for a cell of weight d, in the drift and in the noise's variance.
        let hat = |i: usize, d: f64| {
            let g = case.gamma * d;
            let (z_i, e) = (now[i], noise(1, k, i));
            let beta = case.beta.unwrap_or((1.0 - tau) / tau);
            // Eq. (general_sde) with v_ε = (μ − z)/τ, μ the encoded latent; eq. 5 at the paper's β.
            let v_eps = (z[i] - z_i) / tau;
            let drifted = (1.0 - g / tau) * z_i + beta * g * v[i] - (beta - (1.0 - tau) / tau) * g * v_eps;
            match case.sde {
                Sde::EulerMaruyama => drifted + (2.0 * g).sqrt() * e,
                Sde::VarianceCorrected => drifted + (2.0 * g - (g / tau).powi(2)).sqrt() * e,
                Sde::LeimkuhlerMatthews => {
                    let own = if k == 0 { 3.0 * g / 2.0 } else { g / 2.0 };
                    drifted + own.sqrt() * e + (g / 2.0).sqrt() * noise(1, k + 1, i)
                }
                Sde::Exponential => {
                    let keep = (-g / (tau * tau)).exp();
                    let x0 = z_i + tau * v[i];
                    keep * z_i + (1.0 - keep) * (1.0 - tau) * x0 + tau * (1.0 - keep * keep).sqrt() * e
                }
            }
        };
        now = (0..n)
            .map(|i| match case.act {
                _ if held(i) => now[i],
                Act::Reconstruct if m(i) < 1.0 => hat(i, 1.0 - m(i)),
                Act::Animate if m(i) > 0.0 => hat(i, m(i)),
                _ => now[i],
            })
            .collect();
    }
    // Lines 14–16.
    let levels: Vec<f64> = (0..=case.tau).rev().map(sigma).collect();
    walk(case, &mut now, &levels, case.guidance, &held);
    now
}

fn velocity(case: &Case, z: &[f64], sigma: f64, guidance: Option<f64>) -> Vec<f64> {
    let at = |i: usize| z[i];
    (0..z.len())
        .map(|i| {
            let c = case.velocity(&at, i, sigma, Branch::Conditional);
            match guidance {
                None => c,
                Some(w) => {
                    let u = case.velocity(&at, i, sigma, Branch::Unconditional);
                    u + w * (c - u)
                }
            }
        })
        .collect()
}

/// dz/dσ = −v along noise levels.
fn walk(case: &Case, z: &mut [f64], levels: &[f64], guidance: Option<f64>, held: &dyn Fn(usize) -> bool) {
    let mut earlier: Option<Vec<f64>> = None;
    for (k, pair) in levels.windows(2).enumerate() {
        let (from, to) = (pair[0], pair[1]);
        let h = to - from;
        let f: Vec<f64> = velocity(case, z, from, guidance).iter().map(|v| -v).collect();
        let slope: Vec<f64> = match (case.solver, &earlier) {
            (Solver::Ab2, Some(before)) => {
                let r = h / (2.0 * (from - levels[k - 1]));
                f.iter().zip(before).map(|(f, b)| (1.0 + r) * f - r * b).collect()
            }
            (Solver::Heun, _) => {
                let end: Vec<f64> =
                    z.iter().zip(&f).enumerate().map(|(i, (z, f))| if held(i) { *z } else { z + h * f }).collect();
                let g = velocity(case, &end, to, guidance);
                f.iter().zip(g).map(|(f, g)| 0.5 * (f - g)).collect()
            }
            _ => f.clone(),
        };
        for (i, (z, s)) in z.iter_mut().zip(slope).enumerate() {
            if !held(i) {
                *z += h * s;
            }
        }
        earlier = Some(f);
    }
}

//! What β, τ and N do to mean, variance and mode weight.

use physvideo::flow::{SdeRule, paper_beta, stable_gamma};
use physvideo::scene::Sde;
use physvideo::stages::latent::LatentSetup;
use physvideo_gpu::GpuError;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::{self, Moments, RULES, spread};
use physvideo_tests::flow::run::{Lab, PLAIN, Summary};
use physvideo_tests::flow::schedule::shifted;
use physvideo_tests::plot::{Mark, Panel, Scale, Series};

use super::problems::Problem;
use super::{Bench, CHAIN, GAMMA, ITERATIONS, MANY, START, TAU, cell};

/// Numbers of the sweeps of β and τ.
const SOME: usize = MANY / 4;
/// Data and anchor of the sweep of β.
const MEAN: f64 = 2.0;
const ANCHOR: f64 = -1.0;
const COLORS: [usize; 4] = [6, 1, 5, 3];

/// The figure and its CSV.
pub fn run(bench: &mut Bench) -> Result<(), String> {
    let mut rows = Vec::new();
    let mut panels = betas(bench, &mut rows)?;
    panels.push(taus(bench, &mut rows)?);
    panels.extend(iterations(bench, &mut rows)?);
    bench.csv("sweeps", "sweep,value,integrator,quantity,exact,measured", &rows)?;
    let note = "Lines: exact laws; discs: measured on the device (2^18 numbers for β and τ, 2^20 for N). τ = 28/29 where not swept, γ = 0.2, N = 10.\n\
                β: data N(2, 1), anchor μ = −1. τ: data N(0, 1), from S. N: two modes 0.7 : 0.3, begun in the lighter.";
    bench.figure("sweeps", "Φ_CF: sweeps of β, τ and N", note, &panels, 3)
}

fn panel(title: &str, x: (&str, Scale), y: (&str, Scale), series: Vec<Series>) -> Panel {
    let ((x, x_scale), (y, y_scale)) = (x, y);
    Panel { title: title.into(), x: x.into(), y: y.into(), x_scale, y_scale, y_bounds: None, series }
}

fn both(series: &mut Vec<Series>, name: &str, color: usize, exact: Vec<(f64, f64)>, measured: Vec<(f64, f64)>) {
    series.push(Series { name: name.into(), color, mark: Mark::Line, points: exact });
    series.push(Series { name: String::new(), color, mark: Mark::Disc, points: measured });
}

fn betas(bench: &mut Bench, rows: &mut Vec<Vec<String>>) -> Result<Vec<Panel>, String> {
    let line = laws::line(TAU, MEAN, 1.0);
    let betas = [1e-3, 0.01, paper_beta(TAU), 0.1, 0.3, 1.0, 1.28, 2.58, 5.0, 10.0, 20.0, 27.0, 29.0];
    let (mut means, mut variances) = (Vec::new(), Vec::new());
    for (sde, name, color) in
        [(Sde::EulerMaruyama, "euler_maruyama", 6), (Sde::LeimkuhlerMatthews, "leimkuhler_matthews", 5)]
    {
        let (mut exact, mut measured) = (Vec::new(), Vec::new());
        for beta in betas {
            let rule = SdeRule::new(sde, GAMMA, TAU, Some(beta), false).map_err(|e| e.to_string())?;
            let m = (0..ITERATIONS).fold(Moments::start(0.0, TAU * TAU), |m, n| m.step(rule.step(n), line, ANCHOR));
            exact.push((beta, m.mean, m.variance));
            let mut found = [f64::NAN; 2];
            if bench.allows(|| format!("beta {beta}, {name}, measured")) {
                let s = anchored(bench, rule).map_err(|e| e.to_string())?;
                measured.push((beta, s.mean, s.variance));
                found = [s.mean, s.variance];
            }
            for (what, e, m) in [("mean", m.mean, found[0]), ("variance", m.variance, found[1])] {
                rows.push(vec!["beta".into(), cell(beta), name.into(), what.into(), cell(e), cell(m)]);
            }
        }
        let right = (1.0 - TAU) * MEAN;
        let pick = |all: &[(f64, f64, f64)], mean: bool| {
            all.iter().map(|p| (p.0, if mean { (p.1 - right).abs() } else { p.2 })).collect()
        };
        both(&mut means, name, color, pick(&exact, true), pick(&measured, true));
        both(&mut variances, name, color, pick(&exact, false), pick(&measured, false));
    }
    let points = vec![(betas[0], spread(TAU, 1.0)), (betas[betas.len() - 1], spread(TAU, 1.0))];
    variances.push(Series { name: "the marginal".into(), color: 0, mark: Mark::Dashes, points });
    let x = ("β (the paper: 1/28 = 0.0357; limit 28.04)", Scale::Log);
    Ok(vec![
        panel("mean after 10 iterations", x, ("distance of the mean from the marginal's", Scale::Log), means),
        panel("variance after 10 iterations", x, ("variance of the latent", Scale::Log), variances),
    ])
}

fn anchored(bench: &Bench, rule: SdeRule) -> Result<Summary, GpuError> {
    let anchor = vec![ANCHOR as f32; SOME];
    let setup =
        LatentSetup { elements: SOME as u64, cells: SOME as u64 / 16, anchor: Some(&anchor), ..Default::default() };
    let mut lab = Lab::new(bench.gpu, &setup)?;
    lab.start(|_| 0.0, TAU, START)?;
    let fast = Data::gaussian(MEAN, 1.0).fast(TAU);
    lab.sde(rule, ITERATIONS, CHAIN, &|z, v| fast.fill(z, v))?;
    lab.summary()
}

fn taus(bench: &mut Bench, rows: &mut Vec<Vec<String>>) -> Result<Panel, String> {
    let mut series = Vec::new();
    for ((sde, name), color) in RULES.into_iter().zip(COLORS) {
        let (mut exact, mut measured) = (Vec::new(), Vec::new());
        for index in [1, 2, 3, 4, 5, 7, 10, 15, 20, 23, 25] {
            let tau = shifted(7.0, index, 25);
            let Ok(rule) = SdeRule::new(sde, GAMMA, tau, None, false) else { continue };
            let (s, line) = (spread(tau, 1.0), laws::line(tau, 0.0, 1.0));
            let m = (0..ITERATIONS).fold(Moments::start(0.0, s), |m, n| m.step(rule.step(n), line, 0.0));
            exact.push((f64::from(index), m.variance / s));
            let mut found = f64::NAN;
            if bench.allows(|| format!("tau of step {index}, {name}, measured")) {
                let run = || -> Result<Summary, GpuError> {
                    let mut lab = Lab::plain(bench.gpu, SOME)?;
                    lab.start(|_| 0.0, s.sqrt(), START)?;
                    let fast = Data::gaussian(0.0, 1.0).fast(tau);
                    lab.sde(rule, ITERATIONS, CHAIN, &|z, v| fast.fill(z, v))?;
                    lab.summary()
                };
                found = run().map_err(|e| e.to_string())?.variance / s;
                measured.push((f64::from(index), found));
            }
            let what = format!("variance over S; 2 tau² = {:.4}", stable_gamma(tau));
            rows.push(vec!["tau_step".into(), index.to_string(), name.into(), what, cell(m.variance / s), cell(found)]);
        }
        both(&mut series, name, color, exact, measured);
    }
    let x = ("step of τ of 25, shift 7 (the paper: 20)", Scale::Linear);
    Ok(panel("variance after 10 iterations", x, ("variance over S; 1 is right", Scale::Linear), series))
}

fn iterations(bench: &mut Bench, rows: &mut Vec<Vec<String>>) -> Result<Vec<Panel>, String> {
    const LONGEST: u32 = 40;
    let problems = Problem::all();
    let Some(problem) = problems.last() else { return Ok(Vec::new()) };
    let (target, tau) = (problem.target(), problem.tau);
    let goals = [target.mean / tau, target.variance / (tau * tau), 100.0 * target.upper];
    let mut all: [Vec<Series>; 3] = Default::default();
    let names = ["mean", "variance", "mode weight"];
    for ((sde, name), color) in RULES.into_iter().zip(COLORS) {
        let Some(rule) = problem.rule(sde, GAMMA) else { continue };
        let course = problem.course(rule, LONGEST);
        let mut found = Vec::new();
        if bench.allows(|| format!("N up to {LONGEST}, {name}, measured")) {
            found = measured(bench, problem, rule, LONGEST).map_err(|e| e.to_string())?;
        }
        for k in 0..3 {
            let of = |mean: f64, variance: f64, upper: f64| [mean / tau, variance / (tau * tau), 100.0 * upper][k];
            let exact: Vec<_> =
                course.iter().enumerate().map(|(n, f)| (n as f64, of(f.mean, f.variance, f.upper))).collect();
            let points: Vec<_> = found.iter().map(|(n, s)| (f64::from(*n), of(s.mean, s.variance, s.upper))).collect();
            for (n, e) in &exact {
                let m = points.iter().find(|p| p.0 == *n).map_or(f64::NAN, |p| p.1);
                let quantity = ["mean over tau", "variance over tau²", "mode weight [%]"][k];
                rows.push(vec!["N".into(), format!("{n}"), name.into(), quantity.into(), cell(*e), cell(m)]);
            }
            both(&mut all[k], name, color, exact, points);
        }
    }
    let y = ["mean over τ", "variance over τ²", "weight above 0 [%]"];
    let panels = all.into_iter().enumerate().map(|(k, mut series)| {
        let points = vec![(0.0, goals[k]), (f64::from(LONGEST), goals[k])];
        series.push(Series { name: "the marginal".into(), color: 0, mark: Mark::Dashes, points });
        panel(
            &format!("{} after N", names[k]),
            ("iterations N (the paper: 10)", Scale::Linear),
            (y[k], Scale::Linear),
            series,
        )
    });
    Ok(panels.collect())
}

/// Summaries at some iterations of one chain.
fn measured(bench: &Bench, problem: &Problem, rule: SdeRule, longest: u32) -> Result<Vec<(u32, Summary)>, GpuError> {
    let mut lab = Lab::plain(bench.gpu, MANY)?;
    let (mean, variance) = problem.start();
    lab.start(|_| mean as f32, variance.sqrt(), START)?;
    let fast = problem.data.fast(problem.tau);
    let mut found = vec![(0, lab.summary()?)];
    for n in 1..=longest {
        lab.iterate(n - 1, rule.step(n - 1), PLAIN, CHAIN, &|z, v| fast.fill(z, v))?;
        if n % 5 == 0 || n < 4 {
            found.push((n, lab.summary()?));
        }
    }
    Ok(found)
}

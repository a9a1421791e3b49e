//! Error of the SDE's law against evaluations at a fixed time of the equation, and of its stationary law against 1/γ.

use physvideo_gpu::GpuError;
use physvideo_tests::flow::laws::RULES;
use physvideo_tests::plot::{Mark, Panel, Scale, Series, pareto};

use super::problems::{Figures, Problem};
use super::{Bench, ITERATIONS, cell};

/// N γ of the paper.
const TIME: f64 = 2.0;
const STEPS: [u32; 12] = [1, 2, 3, 4, 5, 6, 8, 10, 14, 20, 28, 40];
const MEASURED: [u32; 7] = [2, 3, 5, 8, 10, 14, 20];
const GAMMAS: [f64; 7] = [1.6, 1.2, 0.8, 0.4, 0.2, 0.1, 0.05];
/// Steps that are measured, and iterations from the marginal in which a single mode settles.
const SETTLED: [(f64, u32); 5] = [(1.6, 16), (0.8, 6), (0.4, 8), (0.2, 16), (0.1, 30)];

/// SDE time in which two modes come into balance to a twentieth.
const BALANCED: f64 = 12.0;

const QUANTITIES: [&str; 3] = ["mean", "variance", "mode weight"];
const HEADER: &str = "problem,integrator,gamma,nfe,mean_error_percent,variance_error_percent,weight_error_percent,\
    measured_mean_error_percent,measured_variance_error_percent,measured_weight_error_percent,\
    mean_standard_error_percent,variance_standard_error_percent,weight_standard_error_percent";

/// Errors of one integrator at one step: exact, and measured with standard errors where it was.
struct Point {
    problem: usize,
    rule: usize,
    gamma: f64,
    nfe: u32,
    x: f64,
    exact: [f64; 3],
    measured: Option<([f64; 3], [f64; 3])>,
}

/// Both diagrams.
pub fn run(bench: &mut Bench) -> Result<(), String> {
    let say = |e: GpuError| e.to_string();
    let problems = Problem::all();
    let (mut timed, mut settled) = (Vec::new(), Vec::new());
    for (p, problem) in problems.iter().enumerate() {
        if !bench.allows(|| format!("SDE figures of {}", problem.name)) {
            continue;
        }
        let right = problem.langevin(TIME);
        let target = problem.target();
        for (r, (sde, name)) in RULES.into_iter().enumerate() {
            for n in STEPS {
                let gamma = TIME / f64::from(n);
                let Some(rule) = problem.rule(sde, gamma) else { continue };
                let exact = problem.after(rule, n).errors(right, problem.tau);
                let wanted =
                    MEASURED.contains(&n) && bench.allows(|| format!("{}, {name}, N = {n}, measured", problem.name));
                let measured = if wanted { Some(problem.measure(bench, rule, n, false).map_err(say)?) } else { None };
                let measured =
                    measured.map(|s| (Figures::from(s).errors(right, problem.tau), bars(s, right, problem.tau)));
                timed.push(Point { problem: p, rule: r, gamma, nfe: n, x: f64::from(n), exact, measured });
            }
            for gamma in GAMMAS {
                let Some(rule) = problem.rule(sde, gamma) else { continue };
                let exact = problem.settled(rule).errors(target, problem.tau);
                let mut iterations = SETTLED.iter().find(|s| s.0 == gamma).map_or(0, |s| s.1);
                if problem.mixed() && iterations > 0 {
                    iterations = iterations.max((BALANCED / gamma).ceil() as u32);
                }
                let wanted = iterations > 0
                    && bench.allows(|| format!("{}, {name}, stationary at gamma {gamma}, measured", problem.name));
                let measured =
                    if wanted { Some(problem.measure(bench, rule, iterations, true).map_err(say)?) } else { None };
                let measured =
                    measured.map(|s| (Figures::from(s).errors(target, problem.tau), bars(s, target, problem.tau)));
                settled.push(Point { problem: p, rule: r, gamma, nfe: iterations, x: 1.0 / gamma, exact, measured });
            }
        }
    }
    disagreements(&problems, &timed, "at time 2");
    let rows: Vec<_> = timed.iter().map(|p| row(&problems, p)).collect();
    bench.csv("sde_time", HEADER, &rows)?;
    let rows: Vec<_> = settled.iter().map(|p| row(&problems, p)).collect();
    bench.csv("sde_stationary", HEADER, &rows)?;
    let floor = "Lines: exact laws (closed forms; quadrature for two modes). Discs: measured on the device, 2^20 numbers; \
                 below the dashed floor of two standard errors they are noise.\nWide grey: Pareto front, the lowest error at \
                 each NFE. Errors of 0 are not on a logarithmic axis, and no front is below them";
    let begun = "Start: N(1.5 τ, τ²). Ring: the paper, euler_maruyama at NFE = 10";
    let x = "NFE = N, at N γ = 2 [evaluations]";
    let all: Vec<_> = (0..problems.len()).map(|p| panel(&problems, &timed, p, 1, x)).collect();
    let note = format!("{floor}: variance_corrected and exponential on points.\n{begun}.");
    bench.figure("sde_variance", "Φ_CF: error of the variance at SDE time 2 against evaluations", &note, &all, 3)?;
    let mut rest: Vec<_> = [0, 2, 4, 5].map(|p| panel(&problems, &timed, p, 0, x)).into();
    rest.extend([4, 5].map(|p| panel(&problems, &timed, p, 2, x)));
    let note = format!(
        "{floor}.\n{begun}. On Gaussian data euler_maruyama, variance_corrected and leimkuhler_matthews have the same mean."
    );
    let title = "Φ_CF: error of mean and mode weight at SDE time 2 against evaluations";
    bench.figure("sde_mean", title, &note, &rest, 3)?;
    let x = "1/γ [evaluations per unit of SDE time]";
    let mut all: Vec<_> = (0..problems.len()).map(|p| panel(&problems, &settled, p, 1, x)).collect();
    all.extend([panel(&problems, &settled, 5, 0, x), panel(&problems, &settled, 5, 2, x)]);
    let note = format!(
        "{floor}: leimkuhler_matthews on Gaussian data and points, variance_corrected and exponential on points.\nMeasured from the marginal; two \
         modes for SDE time 12, after which a twentieth of the way is left. Ring: the paper, 1/γ = 5."
    );
    bench.figure("sde_stationary", "Φ_CF: error of the stationary law against 1/γ", &note, &all, 4)
}

/// Standard errors in the units of [`Figures::errors`].
fn bars(s: physvideo_tests::flow::run::Summary, right: Figures, tau: f64) -> [f64; 3] {
    [s.mean_error() / tau, s.variance_error() / right.variance, s.upper_error()].map(|e| 100.0 * e)
}

fn row(problems: &[Problem], p: &Point) -> Vec<String> {
    let (measured, bars) = p.measured.unwrap_or(([f64::NAN; 3], [f64::NAN; 3]));
    let mut cells = vec![format!("\"{}\"", problems[p.problem].name), RULES[p.rule].1.into(), cell(p.gamma)];
    cells.push(if p.nfe == 0 { String::new() } else { p.nfe.to_string() });
    let weight = problems[p.problem].mixed();
    let all = p.exact.into_iter().chain(measured).chain(bars);
    cells.extend(all.enumerate().map(|(i, v)| cell(if i % 3 == 2 && !weight { f64::NAN } else { v })));
    cells
}

/// Names measured points that are further than four standard errors from the exact law.
fn disagreements(problems: &[Problem], points: &[Point], what: &str) {
    let (mut compared, mut far) = (0, 0);
    for p in points {
        let Some((measured, bars)) = p.measured else { continue };
        for k in 0..if problems[p.problem].mixed() { 3 } else { 2 } {
            compared += 1;
            if (measured[k] - p.exact[k]).abs() > 4.0 * bars[k] {
                far += 1;
                println!(
                    "{}, {}, N = {}: {} is off by {:.3} %, exact {:.3} %, standard error {:.3} %",
                    problems[p.problem].name, RULES[p.rule].1, p.nfe, QUANTITIES[k], measured[k], p.exact[k], bars[k]
                );
            }
        }
    }
    println!("{what}: {compared} measured figures, {far} further than 4 standard errors from the exact law");
}

fn panel(problems: &[Problem], points: &[Point], problem: usize, quantity: usize, x: &str) -> Panel {
    let of = |rule: usize| points.iter().filter(move |p| p.problem == problem && p.rule == rule);
    let here = || points.iter().filter(move |p| p.problem == problem);
    let mut series = Vec::new();
    let front = pareto(&here().map(|p| (p.x, shown(p.exact[quantity]))).collect::<Vec<_>>());
    series.push(Series { name: "Pareto front".into(), color: 0, mark: Mark::Front, points: front });
    for (r, (_, name)) in RULES.into_iter().enumerate() {
        let color = [6, 1, 5, 3][r];
        let exact = of(r).map(|p| (p.x, shown(p.exact[quantity]))).collect();
        series.push(Series { name: name.into(), color, mark: Mark::Line, points: exact });
        let measured = of(r).filter_map(|p| Some((p.x, p.measured?.0[quantity].abs()))).collect();
        series.push(Series { name: String::new(), color, mark: Mark::Disc, points: measured });
    }
    let bars: Vec<f64> = here().filter_map(|p| Some(2.0 * p.measured?.1[quantity])).collect();
    if !bars.is_empty() {
        let floor = bars.iter().fold(f64::INFINITY, |a, b| a.min(*b));
        let ends = [f64::min, f64::max].map(|f| here().map(|p| p.x).reduce(f).unwrap_or(1.0));
        let points = ends.map(|x| (x, floor)).into();
        series.push(Series { name: "Monte-Carlo floor".into(), color: 0, mark: Mark::Dashes, points });
    }
    let paper = of(0).filter(|p| (p.gamma - TIME / f64::from(ITERATIONS)).abs() < 1e-9);
    let paper = paper.map(|p| (p.x, p.exact[quantity].abs())).collect();
    series.push(Series { name: "the paper".into(), color: 0, mark: Mark::Ring, points: paper });
    let unit = ["error of the mean over τ [%]", "error of the variance [%]", "error of the mode's weight [% points]"];
    Panel {
        title: problems[problem].name.into(),
        x: x.into(),
        y: unit[quantity].into(),
        x_scale: Scale::Log,
        y_scale: Scale::Log,
        y_bounds: Some((1e-3, 1e3)).filter(|_| quantity == 1).or(Some((1e-3, 1e2))),
        series,
    }
}

/// What is 0 but for rounding is not shown, and wins.
fn shown(error: f64) -> f64 {
    if error.abs() < 1e-7 { 0.0 } else { error.abs() }
}

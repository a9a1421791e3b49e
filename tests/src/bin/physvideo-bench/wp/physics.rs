//! Every problem with a known answer, by every method, at every resolution and Courant number: error against wall time.
//! Knows the list of problems, and none of them.

use std::path::Path;
use std::time::{Duration, Instant};

use physvideo_tests::plot::{Mark, Panel, Scale, Series, pareto};
use physvideo_tests::problems::{self, Outcome, Problem, Setting};

use super::{Bench, cell};

/// A point that was run, and its wall time over simulated time.
struct Point {
    setting: Setting,
    outcome: Outcome,
    cost: f64,
}

/// Errors at which costs are compared.
const TARGETS: [f64; 3] = [0.01, 0.05, 0.1];
const HEADER: &str =
    "id,method,resolution,courant,error,observed_order,wall_s_per_simulated_s,substeps,clamps,particles";
const SUMMARY: &str = "id,method,wall_s_per_simulated_s_at_1_percent,at_5_percent,at_10_percent";
/// A point that takes less is run three times, and the median time counts.
const CHEAP: Duration = Duration::from_secs(1);

/// Sweeps the problem called `only`, or all of them.
pub fn run(bench: &mut Bench, only: Option<&str>) -> Result<(), String> {
    let all: Vec<_> = problems::all().into_iter().filter(|p| only.is_none_or(|id| p.id == id)).collect();
    if all.is_empty() {
        let ids: Vec<_> = problems::all().iter().map(|p| p.id).collect();
        return Err(format!("there is no such problem; there are {}", ids.join(", ")));
    }
    let mut summary = kept(&bench.out.join("summary.csv"), &all);
    for (i, problem) in all.iter().enumerate() {
        // What one problem leaves of its share goes to those after it.
        let now = Instant::now();
        let share = bench.until.saturating_duration_since(now) / (all.len() - i) as u32;
        let points = sweep(bench, problem, now + share);
        let name = problem.id.to_lowercase();
        bench.csv(&name, HEADER, &points.iter().map(|p| row(problem, &points, p)).collect::<Vec<_>>())?;
        let (title, _) = problem.title.split_once(',').unwrap_or((problem.title, ""));
        let note = format!(
            "{}.\nLines with discs: Courant number {}; dashes: smaller ones, each further to the right. Pale: what nothing beats.",
            problem.title,
            problem.courants.last().copied().unwrap_or_default()
        );
        bench.figure(&name, &format!("{}: {title}", problem.id), &note, &panels(problem, &points), 2)?;
        for method in problem.methods {
            let own: Vec<_> = points.iter().filter(|p| p.setting.method == *method).collect();
            let front = pareto(&own.iter().map(|p| (p.cost, p.outcome.error)).collect::<Vec<_>>());
            let mut line = vec![problem.id.to_string(), (*method).to_string()];
            line.extend(TARGETS.map(|e| cell(cost_at(&front, e))));
            summary.push(line);
        }
    }
    bench.csv("summary", SUMMARY, &summary)
}

/// Lines of an earlier summary about other problems.
fn kept(path: &Path, now: &[&Problem]) -> Vec<Vec<String>> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let rows = text.lines().skip(1).map(|l| l.split(',').map(str::to_string).collect::<Vec<_>>());
    rows.filter(|r| now.iter().all(|p| p.id != r[0])).collect()
}

/// Runs what there is time for, cheap points first.
fn sweep(bench: &mut Bench, problem: &Problem, until: Instant) -> Vec<Point> {
    let mut settings = Vec::new();
    for resolution in problem.resolutions {
        for courant in problem.courants.iter().rev() {
            for method in problem.methods {
                settings.push(Setting { method, resolution: *resolution, courant: *courant });
            }
        }
    }
    let mut points: Vec<Point> = Vec::new();
    let mut took: Vec<(Setting, Duration)> = Vec::new();
    for setting in settings {
        let Setting { method, resolution, courant } = setting;
        let what = format!("{} {method}, {resolution} cells, Courant number {courant}", problem.id);
        // Time grows at most with the fourth power of the resolution in three dimensions, and with steps.
        let mut before = took.iter().filter(|(s, _)| s.method == method).map(|(s, time)| {
            let growth = (f64::from(resolution) / f64::from(s.resolution)).powi(3);
            time.as_secs_f64() * growth * f64::from(s.courant / courant)
        });
        let expected = before.next_back().unwrap_or(0.0);
        let left = until.saturating_duration_since(Instant::now()).as_secs_f64();
        if expected > left || left == 0.0 {
            bench.left_out.push(what);
            continue;
        }
        let begin = Instant::now();
        match (problem.run)(bench.gpu, setting) {
            Ok(outcome) if outcome.error.is_finite() => {
                took.push((setting, begin.elapsed()));
                let mut walls = vec![outcome.wall_s];
                while begin.elapsed() < CHEAP && walls.len() < 3 {
                    walls.extend((problem.run)(bench.gpu, setting).map(|again| again.wall_s));
                }
                walls.sort_by(f64::total_cmp);
                let cost = walls[walls.len() / 2] / outcome.simulated_s;
                println!("{what}: error {:.3} %, {cost:.3} s a simulated second", 100.0 * outcome.error);
                points.push(Point { setting, outcome, cost });
            }
            Ok(outcome) => bench.failed.push(format!("{what}: error {}", outcome.error)),
            Err(why) => bench.failed.push(format!("{what}: {why}")),
        }
    }
    points
}

fn row(problem: &Problem, points: &[Point], p: &Point) -> Vec<String> {
    let (s, o) = (p.setting, p.outcome);
    // Against the next coarser one of the same method and Courant number.
    let coarser = points
        .iter()
        .rev()
        .find(|q| Setting { resolution: s.resolution, ..q.setting } == s && q.setting.resolution < s.resolution);
    let order = coarser
        .map_or(f64::NAN, |q| problems::order(&[q, p].map(|r| (f64::from(r.setting.resolution), r.outcome.error))));
    let order = if order.is_finite() { format!("{order:.2}") } else { String::new() };
    let mut out = vec![problem.id.to_string(), s.method.into(), s.resolution.to_string(), s.courant.to_string()];
    out.extend([cell(o.error), order, cell(p.cost)]);
    out.extend([o.substeps, o.clamps, o.particles].map(|n| n.to_string()));
    out
}

/// Where a front reaches an error, by lines through logarithms; the cheapest point where that is better already.
fn cost_at(front: &[(f64, f64)], error: f64) -> f64 {
    let Some(after) = front.iter().position(|p| p.1 <= error) else { return f64::NAN };
    let Some(before) = after.checked_sub(1) else { return front[0].0 };
    let ((x0, y0), (x1, y1)) = (front[before], front[after]);
    let share = (y0 / error).ln() / (y0 / y1.max(f64::MIN_POSITIVE)).ln();
    (x0.ln() + share * (x1 / x0).ln()).exp()
}

fn panels(problem: &Problem, points: &[Point]) -> Vec<Panel> {
    let percent = |p: &Point| 100.0 * p.outcome.error;
    let panel = |x: &str, of: fn(&Point) -> f64| {
        let mut series = Vec::new();
        for (color, method) in problem.methods.iter().enumerate() {
            for (i, courant) in problem.courants.iter().rev().enumerate() {
                let own = points.iter().filter(|p| p.setting.method == *method && p.setting.courant == *courant);
                let places: Vec<_> = own.map(|p| (of(p), percent(p))).collect();
                let name = if i == 0 { (*method).to_string() } else { String::new() };
                let mark = if i == 0 { Mark::Line } else { Mark::Dashes };
                series.push(Series { name, color: [5, 6, 3, 7, 1, 2, 4][color % 7], mark, points: places.clone() });
                let mark = if i == 0 { Mark::Disc } else { Mark::Ring };
                series.push(Series {
                    name: String::new(),
                    color: [5, 6, 3, 7, 1, 2, 4][color % 7],
                    mark,
                    points: places,
                });
            }
        }
        let ends = |pick: fn(f64, f64) -> f64, from: f64| points.iter().map(of).fold(from, pick);
        let goal = 100.0 * problem.goal;
        let line = vec![(ends(f64::min, f64::INFINITY), goal), (ends(f64::max, 0.0), goal)];
        series.push(Series { name: "goal".into(), color: 0, mark: Mark::Dashes, points: line });
        Panel {
            title: format!("error against {}", x.split(',').next().unwrap_or(x)),
            x: x.into(),
            y: "error [%]".into(),
            x_scale: Scale::Log,
            y_scale: Scale::Log,
            y_bounds: None,
            series,
        }
    };
    let mut cost = panel("wall time, seconds a simulated second", |p| p.cost);
    let front = pareto(&points.iter().map(|p| (p.cost, percent(p))).collect::<Vec<_>>());
    cost.series.push(Series { name: "front".into(), color: 0, mark: Mark::Front, points: front });
    vec![cost, panel("resolution, cells or particles", |p| f64::from(p.setting.resolution))]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_front_is_read_between_its_points() {
        let front = [(1.0, 0.4), (10.0, 0.04), (100.0, 0.004)];
        assert!((cost_at(&front, 0.04) - 10.0).abs() < 1e-9);
        // Half a decade of error is half a decade of time.
        assert!((cost_at(&front, 0.04 / 10f64.sqrt()) - 10f64.powf(1.5)).abs() < 1e-9);
        assert!((cost_at(&front, 0.9) - 1.0).abs() < 1e-9);
        assert!(cost_at(&front, 0.001).is_nan());
    }
}

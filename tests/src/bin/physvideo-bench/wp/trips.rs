//! Error of inversion and generation back against evaluations, for the solvers of F.

use physvideo::scene::Solver;
use physvideo::stages::latent::LatentSetup;
use physvideo_gpu::GpuError;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::SOLVERS;
use physvideo_tests::flow::run::{Lab, host_flow};
use physvideo_tests::flow::schedule::levels;
use physvideo_tests::plot::{Mark, Panel, Scale, Series, pareto};

use super::{Bench, cell};

/// Steps of the schedule; the SDE is at 0.8 of them.
const STEPS: [u32; 9] = [5, 10, 15, 20, 25, 40, 50, 75, 100];
const NUMBERS: usize = 256;

struct Point {
    steps: u32,
    nfe: u32,
    exact: f64,
    measured: Option<f64>,
}

/// The diagram.
pub fn run(bench: &mut Bench) -> Result<(), String> {
    let (mut panels, mut rows) = (Vec::new(), Vec::new());
    for (shift, s2) in [(7.0, 1.0), (7.0, 0.25), (2.33, 1.0), (2.33, 0.25)] {
        let mut series = Vec::new();
        let mut all = Vec::new();
        for ((solver, name, evaluations), color) in SOLVERS.into_iter().zip([6, 5, 3]) {
            let mut points = Vec::new();
            for steps in STEPS {
                let up = levels(shift, steps * 4 / 5, steps);
                let measured =
                    if bench.allows(|| format!("round trip of {name}, {steps} steps, shift {shift}, measured")) {
                        Some(measure(bench, solver, &up, s2).map_err(|e| e.to_string())?)
                    } else {
                        None
                    };
                let nfe = 2 * evaluations * (up.len() as u32 - 1);
                points.push(Point { steps, nfe, exact: exact(solver, &up, s2), measured });
            }
            let percent = |e: f64| 100.0 * (e - 1.0).abs();
            let line: Vec<_> = points.iter().map(|p| (f64::from(p.nfe), percent(p.exact))).collect();
            let discs = points.iter().filter_map(|p| Some((f64::from(p.nfe), percent(p.measured?)))).collect();
            all.extend(line.clone());
            series.push(Series { name: name.into(), color, mark: Mark::Line, points: line });
            series.push(Series { name: String::new(), color, mark: Mark::Disc, points: discs });
            // The paper's 25 steps.
            let paper = points.iter().filter(|p| p.steps == 25).map(|p| (f64::from(p.nfe), percent(p.exact))).collect();
            series.push(Series { name: "25 steps, as in the paper".into(), color: 0, mark: Mark::Ring, points: paper });
            for p in &points {
                let measured = p.measured.unwrap_or(f64::NAN);
                rows.push(vec![
                    format!("{shift}"),
                    format!("{s2}"),
                    name.into(),
                    p.steps.to_string(),
                    p.nfe.to_string(),
                    cell(p.exact),
                    cell(measured),
                ]);
            }
        }
        series.push(Series { name: "Pareto front".into(), color: 0, mark: Mark::Front, points: pareto(&all) });
        panels.push(Panel {
            title: format!("shift {shift}, s² = {s2}"),
            x: "NFE there and back [evaluations]".into(),
            y: "error of z₀ after the trip [%]".into(),
            x_scale: Scale::Log,
            y_scale: Scale::Log,
            y_bounds: None,
            series,
        });
    }
    bench.csv("round_trip", "shift,data_variance,solver,steps,nfe,factor,measured_factor", &rows)?;
    let note = "Gaussian data of variance s². Inversion from σ = 0 to 0.8 of the steps, and generation back. Lines: f64; discs: the device.\n\
                Heun takes two evaluations a step. Wide grey: Pareto front.";
    bench.figure("round_trip", "F and F⁻¹: error of the round trip against evaluations", note, &panels, 2)
}

fn exact(solver: Solver, up: &[f64], s2: f64) -> f64 {
    let down: Vec<f64> = up.iter().rev().copied().collect();
    let data = Data::gaussian(0.0, s2.sqrt());
    let velocity = |sigma: f64, z: f64| data.velocity(z, sigma);
    host_flow(&down, solver, host_flow(up, solver, 1.0, &velocity), &velocity)
}

/// Factor by which the device's numbers come back, by least squares.
fn measure(bench: &Bench, solver: Solver, up: &[f64], s2: f64) -> Result<f64, GpuError> {
    let setup = LatentSetup { elements: NUMBERS as u64, cells: 16, history: true, ..Default::default() };
    let mut lab = Lab::new(bench.gpu, &setup)?;
    let start: Vec<f32> = (0..NUMBERS).map(|i| (i as f32 - 127.5) / 50.0).collect();
    lab.space.set(&start)?;
    let data = Data::gaussian(0.0, s2.sqrt());
    let velocity = |sigma: f64, z: &[f32], v: &mut [f32]| data.fast(sigma).fill(z, v);
    let down: Vec<f64> = up.iter().rev().copied().collect();
    lab.flow(up, solver, &velocity)?;
    lab.flow(&down, solver, &velocity)?;
    let product = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>();
    Ok(product(&lab.space.get()?, &start) / product(&start, &start))
}

//! The paper's figure of norms, γ by γ, and where each integrator becomes unstable.

use physvideo::flow::{SdeRule, stable_gamma};
use physvideo::scene::Sde;
use physvideo_gpu::GpuError;
use physvideo_tests::flow::data::Data;
use physvideo_tests::flow::laws::{self, Moments, spread};
use physvideo_tests::flow::run::{Lab, PLAIN};
use physvideo_tests::plot::{Mark, Panel, Scale, Series};

use super::{Bench, CHAIN, MANY, START, TAU, cell};

const GAMMAS: [f64; 9] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.2, 1.6, 1.8, 1.9];
const ITERATIONS: u32 = 15;
/// Iterations and halvings that find a limit to a three-hundredth.
const LONG: u32 = 60;
const HALVINGS: u32 = 10;

/// Both panels of norms, and the limits.
pub fn run(bench: &mut Bench) -> Result<(), String> {
    let say = |e: GpuError| e.to_string();
    let (mut rows, mut panels) = (Vec::new(), Vec::new());
    for (sde, name) in [(Sde::EulerMaruyama, "euler_maruyama"), (Sde::LeimkuhlerMatthews, "leimkuhler_matthews")] {
        let mut series = Vec::new();
        for (i, gamma) in GAMMAS.into_iter().enumerate() {
            let Ok(rule) = SdeRule::new(sde, gamma, TAU, None, false) else { continue };
            let line = laws::line(TAU, 0.0, 0.0);
            let mut exact = vec![Moments::start(0.0, TAU * TAU)];
            (0..ITERATIONS).for_each(|n| exact.push(exact[n as usize].step(rule.step(n), line, 0.0)));
            let mut measured = vec![f64::NAN; exact.len()];
            if bench.allows(|| format!("norms of {name} at gamma {gamma}, measured")) {
                let mut lab = Lab::plain(bench.gpu, MANY).map_err(say)?;
                lab.start(|_| 0.0, TAU, START).map_err(say)?;
                measured[0] = lab.space.stats().map_err(say)?.rms / TAU;
                let fast = Data::point(0.0).fast(TAU);
                let mut n = 1;
                let steps = (0..ITERATIONS).map(|n| rule.step(n));
                let each = |s: physvideo::stages::latent::LatentStats| {
                    measured[n] = s.rms / TAU;
                    n += 1;
                };
                lab.chain(steps, PLAIN, CHAIN, &|z, v| fast.fill(z, v), each).map_err(say)?;
            }
            for (n, (e, m)) in exact.iter().zip(&measured).enumerate() {
                rows.push(vec![name.into(), format!("{gamma}"), n.to_string(), cell(e.rms() / TAU), cell(*m)]);
            }
            let label = format!("γ = {gamma}");
            let points = exact.iter().enumerate().map(|(n, e)| (n as f64, e.rms() / TAU)).collect();
            let mark = if i < 8 { Mark::Line } else { Mark::Dashes };
            series.push(Series { name: label, color: i, mark, points });
            let points = measured.iter().enumerate().map(|(n, m)| (n as f64, *m)).collect();
            series.push(Series { name: String::new(), color: i, mark: Mark::Disc, points });
        }
        panels.push(Panel {
            title: format!("{name}, point data, τ = 28/29"),
            x: "iteration n".into(),
            y: "rms of the latent over τ; 1 is right".into(),
            x_scale: Scale::Linear,
            y_scale: Scale::Log,
            y_bounds: Some((0.9, 20.0)),
            series,
        });
    }
    bench.csv("norms", "integrator,gamma,iteration,rms_over_tau,measured_rms_over_tau", &rows)?;
    panels.push(limits(bench)?);
    let note = "Left, middle: the paper's figure of norms. Lines: exact; discs: measured on the device, 2^20 numbers (standard error 0.07 %).\n\
                Right: largest γ from which a latent returns, by bisection on the device; 2τ² is safe whatever the data.";
    bench.figure("norms", "Φ_CF: norm of the latent at each iteration, and the limit of γ", note, &panels, 3)
}

fn limits(bench: &mut Bench) -> Result<Panel, String> {
    let (mut rows, mut series) = (Vec::new(), Vec::new());
    let rules = [(Sde::EulerMaruyama, "euler_maruyama"), (Sde::LeimkuhlerMatthews, "leimkuhler_matthews")];
    println!("largest stable gamma by bisection:");
    for (k, (what, s2, two)) in
        [("point", 0.0, false), ("two points", 0.0, true), ("Gaussian, s = 1", 1.0, false)].into_iter().enumerate()
    {
        let mut points = Vec::new();
        for tau in [0.5, 0.65, 0.8, TAU] {
            let data = if two { Data::two_points(tau, 1.5, 0.5) } else { Data::gaussian(0.0, f64::sqrt(s2)) };
            for (sde, name) in rules {
                if !bench.allows(|| format!("limit of gamma of {name}, {what}, tau {tau}")) {
                    continue;
                }
                let (mut low, mut high) = (0.5 * stable_gamma(tau), 3.0 * spread(tau, s2));
                for _ in 0..HALVINGS {
                    let middle = 0.5 * (low + high);
                    if returns(bench, sde, middle, tau, &data).map_err(|e| e.to_string())? {
                        low = middle;
                    } else {
                        high = middle;
                    }
                }
                let found = 0.5 * (low + high);
                println!(
                    "  {what:<16} tau {tau:.4} {name:<20} {found:.4} ± {:.4}; 2 tau² = {:.4}, 2 S = {:.4}",
                    0.5 * (high - low),
                    stable_gamma(tau),
                    2.0 * spread(tau, s2)
                );
                points.push((tau, found));
                rows.push(vec![
                    what.into(),
                    cell(tau),
                    name.into(),
                    cell(found),
                    cell(0.5 * (high - low)),
                    cell(stable_gamma(tau)),
                    cell(2.0 * spread(tau, s2)),
                ]);
            }
        }
        let mark = if two { Mark::Ring } else { Mark::Disc };
        series.push(Series { name: format!("limit, {what}"), color: [6, 0, 3][k], mark, points });
    }
    let taus: Vec<f64> = (0..=50).map(|i| 0.45 + 0.011 * f64::from(i)).collect();
    for (name, color, s2) in [("2τ²", 6, 0.0), ("2S, s = 1", 3, 1.0)] {
        let points = taus.iter().map(|t| (*t, 2.0 * spread(*t, s2))).collect();
        series.push(Series { name: name.into(), color, mark: Mark::Dashes, points });
    }
    bench.csv("stability", "data,tau,integrator,gamma_limit,half_width,two_tau_squared,two_s", &rows)?;
    Ok(Panel {
        title: "limit of γ".into(),
        x: "noise level τ".into(),
        y: "largest stable γ".into(),
        x_scale: Scale::Linear,
        y_scale: Scale::Linear,
        y_bounds: Some((0.0, 2.2)),
        series,
    })
}

/// Whether a latent far away, where noise is nothing, is nearer after many iterations.
fn returns(bench: &Bench, sde: Sde, gamma: f64, tau: f64, data: &Data) -> Result<bool, GpuError> {
    const FAR: f32 = 1e4;
    let Ok(rule) = SdeRule::new(sde, gamma, tau, None, false) else { return Ok(false) };
    let mut lab = Lab::plain(bench.gpu, 64)?;
    lab.start(|_| FAR, 0.0, START)?;
    let fast = data.fast(tau);
    lab.sde(rule, LONG, CHAIN, &|z, v| fast.fill(z, v))?;
    let rms = lab.space.stats()?.rms;
    Ok(rms < f64::from(FAR))
}

//! How many evaluations reach the accuracy of the paper's setting: Euler–Maruyama, N = 10, γ = 0.2.

use physvideo_tests::flow::laws::RULES;

use super::problems::Problem;
use super::{Bench, GAMMA, ITERATIONS, cell};

/// Most evaluations that are tried.
const MOST: u32 = 20;

/// A table on the screen and as CSV.
pub fn run(bench: &mut Bench) -> Result<(), String> {
    let time = GAMMA * f64::from(ITERATIONS);
    let mut rows = Vec::new();
    println!("evaluations for the accuracy of euler_maruyama with N = 10, gamma = 0.2 (same SDE time 2); exact laws");
    println!("{:<32} {:<22} {:>9} {:>5} {:>5} {:>5} {:>5}", "problem", "figure", "paper", "EM", "corr", "LM", "exp");
    for problem in Problem::all() {
        if !bench.allows(|| format!("paper's accuracy on {}", problem.name)) {
            continue;
        }
        let (right, target) = (problem.langevin(time), problem.target());
        // errors[rule][N − 1]: at time 2 and stationary.
        let errors: Vec<Vec<Option<[f64; 6]>>> = RULES
            .iter()
            .map(|(sde, _)| {
                (1..=MOST)
                    .map(|n| {
                        let rule = problem.rule(*sde, time / f64::from(n))?;
                        let a = problem.after(rule, n).errors(right, problem.tau);
                        let b = problem.settled(rule).errors(target, problem.tau);
                        Some([a[0], a[1], a[2], b[0], b[1], b[2]].map(f64::abs))
                    })
                    .collect()
            })
            .collect();
        let names = ["mean", "variance", "mode weight", "stationary mean", "stationary variance", "stationary weight"];
        for (k, name) in names.into_iter().enumerate() {
            let paper = errors[0][ITERATIONS as usize - 1].map_or(f64::NAN, |e| e[k]);
            // Symmetric data have no error of the stationary mean or weight; Gaussians no modes.
            if paper.is_nan() || paper < 1e-6 {
                continue;
            }
            // From the fewest on which no more evaluations are worse than the paper.
            let reached: Vec<Option<u32>> = errors
                .iter()
                .map(|all| {
                    let good = |n: &u32| all[*n as usize - 1].is_some_and(|e| e[k] <= paper * (1.0 + 1e-9));
                    (1..=MOST).rev().take_while(good).last()
                })
                .collect();
            let text: Vec<String> = reached.iter().map(|n| n.map_or(format!(">{MOST}"), |n| n.to_string())).collect();
            println!(
                "{:<32} {name:<22} {paper:>7.3} % {:>5} {:>5} {:>5} {:>5}",
                problem.name, text[0], text[1], text[2], text[3]
            );
            for ((_, rule), n) in RULES.into_iter().zip(&reached) {
                let saving = n.map_or(f64::NAN, |n| 100.0 * (1.0 - f64::from(n) / f64::from(ITERATIONS)));
                let n = n.map_or(format!(">{MOST}"), |n| n.to_string());
                let saving = if saving.is_finite() { format!("{saving:.0}") } else { String::new() };
                rows.push(vec![format!("\"{}\"", problem.name), name.into(), cell(paper), rule.into(), n, saving]);
            }
        }
    }
    bench.csv("paper_accuracy", "problem,quantity,paper_error_percent,integrator,nfe,saving_percent", &rows)
}

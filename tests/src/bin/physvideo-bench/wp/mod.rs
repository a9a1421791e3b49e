//! Work–precision diagrams: wall time of the particle solvers, or evaluations of the network, against error. Each figure
//! is an SVG and a CSV of the same name; what a budget leaves out is named.

mod budget;
mod cost;
mod norms;
mod physics;
mod problems;
mod sde;
mod sweeps;
mod table;
mod trips;

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use clap::Subcommand;
use physvideo::stages::latent::NoiseKey;
use physvideo_gpu::Gpu;
use physvideo_tests::plot::{self, Panel};

/// Problems.
#[derive(Subcommand)]
pub enum Problem {
    /// The Flow SDE Φ_CF and the flow's inversion, on data whose velocity is known.
    Flow {
        /// Minutes after which no further point is measured.
        #[arg(long, default_value_t = 15.0)]
        budget: f64,
        /// Folder for the figures.
        #[arg(long, default_value = "assets/wp")]
        out: PathBuf,
    },
    /// The tables from which `--error-budget` chooses.
    Budget {
        /// Only that of this kind of body, for example sand.
        #[arg(long)]
        kind: Option<String>,
        /// Measure blocks that no table was made with instead, and write nothing.
        #[arg(long)]
        unseen: bool,
        /// Folder for them.
        #[arg(long, default_value = "engine/src/accuracy")]
        out: PathBuf,
    },
    /// The particle solvers, on problems whose answer is known: wall time against error.
    Physics {
        /// Only this one, for example M5.
        #[arg(long)]
        problem: Option<String>,
        /// Minutes, divided among the problems.
        #[arg(long, default_value_t = 25.0)]
        budget: f64,
        /// Folder for the figures.
        #[arg(long, default_value = "assets/wp")]
        out: PathBuf,
    },
}

/// Numbers of a latent whose moments are measured.
const MANY: usize = 1 << 20;
/// The paper's noise level: step 20 of 25 with shift 7.
const TAU: f64 = 28.0 / 29.0;
/// The paper's step, and its iterations.
const GAMMA: f64 = 0.2;
const ITERATIONS: u32 = 10;
const CHAIN: NoiseKey = NoiseKey { seed: 1, stream: 1 };
const START: NoiseKey = NoiseKey { seed: 1, stream: 2 };

/// What all figures share: the device, the folder, and the time that is left.
struct Bench<'gpu> {
    gpu: &'gpu Gpu,
    out: &'gpu Path,
    until: Instant,
    left_out: Vec<String>,
    failed: Vec<String>,
}

impl Bench<'_> {
    /// Whether there is time for something; else it is noted as left out.
    fn allows(&mut self, what: impl FnOnce() -> String) -> bool {
        let allowed = Instant::now() < self.until;
        if !allowed {
            self.left_out.push(what());
        }
        allowed
    }

    fn write(&self, name: &str, text: &str) -> Result<(), String> {
        let path = self.out.join(name);
        std::fs::write(&path, text).map_err(|e| format!("{}: {e}", path.display()))?;
        println!("wrote {}", path.display());
        Ok(())
    }

    fn figure(&self, name: &str, title: &str, note: &str, panels: &[Panel], columns: usize) -> Result<(), String> {
        self.write(&format!("{name}.svg"), &plot::figure(title, note, panels, columns))
    }

    fn csv(&self, name: &str, header: &str, rows: &[Vec<String>]) -> Result<(), String> {
        let lines: String = rows.iter().map(|r| r.join(",") + "\n").collect();
        self.write(&format!("{name}.csv"), &format!("{header}\n{lines}"))
    }
}

/// A number for a CSV: empty where there is none.
fn cell(v: f64) -> String {
    if v.is_finite() { format!("{v:.6e}") } else { String::new() }
}

/// Makes every figure of a problem.
pub fn bench(gpu: &Gpu, problem: &Problem) -> Result<(), String> {
    let (budget, out) = match problem {
        Problem::Budget { kind, unseen, out } => return budget::run(gpu, out, kind.as_deref(), *unseen),
        Problem::Flow { budget, out } | Problem::Physics { budget, out, .. } => (budget, out),
    };
    if !(*budget >= 0.0 && *budget < 1e6) {
        return Err("the budget is a number of minutes".into());
    }
    std::fs::create_dir_all(out).map_err(|e| format!("{}: {e}", out.display()))?;
    let begin = Instant::now();
    let until = begin + Duration::from_secs_f64(60.0 * budget);
    let mut bench = Bench { gpu, out, until, left_out: Vec::new(), failed: Vec::new() };
    match problem {
        Problem::Budget { .. } => {}
        Problem::Flow { .. } => {
            cost::run(&mut bench)?;
            trips::run(&mut bench)?;
            norms::run(&mut bench)?;
            table::run(&mut bench)?;
            sweeps::run(&mut bench)?;
            sde::run(&mut bench)?;
        }
        Problem::Physics { problem, .. } => physics::run(&mut bench, problem.as_deref())?,
    }
    println!("{:.1} minutes", begin.elapsed().as_secs_f64() / 60.0);
    for what in &bench.left_out {
        println!("left out by --budget: {what}");
    }
    for what in &bench.failed {
        println!("no result: {what}");
    }
    Ok(())
}

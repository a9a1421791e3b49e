//! Benchmarks: kernels in isolation with their error beside the time, the whole MPM substep, a frame of points, and
//! diagrams of work against precision. Nothing here ships with the product; times come from the device's own clock and
//! hold only as ratios within one run.

mod lagrangian;
mod mpm;
mod points;
mod skip;
mod sph;
mod stress;
mod wp;

use std::collections::BTreeMap;

use clap::{Parser, Subcommand};
use physvideo::scene::Pressure;
use physvideo_gpu::{Command, Gpu, Options, Recording};
use physvideo_tests::proof::{CASES, harness};

/// Benchmarks of physvideo-engine.
#[derive(Parser)]
struct Arguments {
    #[command(subcommand)]
    what: What,
    /// Device: index or part of its name.
    #[arg(long, global = true)]
    device: Option<String>,
    /// Read the kernels anew from this folder instead of those built in, to try a change without a build.
    #[arg(long, global = true)]
    wgsl: Option<std::path::PathBuf>,
    /// One JSON object a line instead of a table.
    #[arg(long, global = true)]
    json: bool,
}

#[derive(Subcommand)]
enum What {
    /// Every kernel in isolation: time, traffic, arithmetic and largest error against its f64 twin.
    Kernels {
        /// Items of a call.
        #[arg(long, default_value_t = 4096)]
        items: usize,
        /// Counted calls.
        #[arg(long, default_value_t = 9)]
        repeats: usize,
        /// Only kernels whose name holds this.
        #[arg(long, default_value = "")]
        only: String,
    },
    /// The whole MLS-MPM substep on the peers' falling cube, 128 cells a metre.
    Mpm {
        /// What the cube is made of.
        #[arg(long, value_enum, default_value = "elastic")]
        material: mpm::Stuff,
        /// Particles along an edge of the cube; 37 gives 50,653.
        #[arg(long, default_value_t = 37)]
        edge: usize,
        /// Particle spacing [m]: half a cell is 8 per cell, the peers' scenes use 5e-3.
        #[arg(long, default_value_t = 1.0 / 256.0)]
        spacing: f32,
        /// Substeps in a counted frame.
        #[arg(long, default_value_t = 100)]
        substeps: u32,
        /// Counted frames.
        #[arg(long, default_value_t = 5)]
        repeats: usize,
        /// Every form of the transfer to the grid instead of the device's own.
        #[arg(long)]
        all: bool,
    },
    /// The same falling cube with both elastic solvers, updated Lagrangian (MPM) and total Lagrangian, in turns.
    Elastic {
        /// Particles along an edge of the cube; 37 gives 50,653.
        #[arg(long, default_value_t = 37)]
        edge: usize,
        /// Substeps in a counted frame.
        #[arg(long, default_value_t = 100)]
        substeps: u32,
        /// Counted frames of each.
        #[arg(long, default_value_t = 5)]
        repeats: usize,
    },
    /// The whole step of SPH on the peers' dam break: particles of 1.3 cm, steps of 4e-4 s, 5e-3 m²/s.
    Sph {
        /// `wcsph` or `dfsph`.
        #[arg(long, default_value = "wcsph", value_parser = pressure)]
        pressure: Pressure,
        /// Mean excess of density at which DFSPH's solve ends; 5e-4 is what the peers take.
        #[arg(long, default_value_t = 1e-4)]
        density_error: f32,
        /// Particles; the cube nearest to this is taken.
        #[arg(long, default_value_t = 50_000)]
        n: usize,
        /// Steps in a counted frame.
        #[arg(long, default_value_t = 50)]
        steps: u32,
        /// Counted frames.
        #[arg(long, default_value_t = 5)]
        repeats: usize,
        /// Honey instead, 7e-3 m²/s in particles of 4 mm, with the steps its limits give: viscosity from the velocities
        /// at hand and solved for, in turns.
        #[arg(long)]
        honey: bool,
    },
    /// A frame of random points in a cube of 1 m, one pixel each, nearest first, with the peers' camera.
    Points {
        /// Points.
        #[arg(long, default_value_t = 1_000_000)]
        points: usize,
        /// Width of the frame [px].
        #[arg(long, default_value_t = 1280)]
        width: u32,
        /// Height of the frame [px].
        #[arg(long, default_value_t = 720)]
        height: u32,
        /// Counted frames.
        #[arg(long, default_value_t = 15)]
        repeats: usize,
    },
    /// What a scene does not need: time of a substep in a domain 8 times as large, and where some bodies rest.
    Skip {
        /// Counted frames of 50 substeps.
        #[arg(long, default_value_t = 9)]
        repeats: usize,
    },
    /// Cases that must not explode, as a table.
    Stress {
        /// Only cases whose name holds this.
        #[arg(long, default_value = "")]
        only: String,
        /// Write stress.csv and stress.md into this folder.
        #[arg(long)]
        out: Option<std::path::PathBuf>,
    },
    /// Work–precision diagrams: evaluations of the network against error, as SVG and CSV.
    Wp {
        #[command(subcommand)]
        problem: wp::Problem,
    },
}

fn pressure(word: &str) -> Result<Pressure, String> {
    match word {
        "wcsph" => Ok(Pressure::Wcsph),
        "dfsph" => Ok(Pressure::Dfsph),
        other => Err(format!("`{other}` is neither wcsph nor dfsph")),
    }
}

fn main() {
    let arguments = Arguments::parse();
    if let Err(message) = run(&arguments) {
        eprintln!("{message}");
        std::process::exit(1);
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let gpu =
        Gpu::new(Options { device: arguments.device.clone(), wgsl: arguments.wgsl.clone(), ..Default::default() })
            .map_err(|e| e.to_string())?;
    println!("# {} ({})", gpu.info.name, gpu.info.driver);
    match arguments.what {
        What::Kernels { items, repeats, ref only } => kernels(&gpu, arguments.json, items, repeats, only),
        What::Mpm { material, edge, spacing, substeps, repeats, all } => {
            mpm::bench(&gpu, material, edge, spacing, substeps, repeats, all)
        }
        What::Elastic { edge, substeps, repeats } => lagrangian::bench(&gpu, edge, substeps, repeats),
        What::Sph { n, repeats, honey: true, .. } => sph::honey(&gpu, n, repeats),
        What::Sph { pressure, density_error, n, steps, repeats, .. } => {
            sph::bench(&gpu, pressure, density_error, n, steps, repeats)
        }
        What::Points { points, width, height, repeats } => points::bench(&gpu, points, [width, height], repeats),
        What::Skip { repeats } => skip::bench(&gpu, repeats),
        What::Stress { ref only, ref out } => stress::bench(&gpu, only, out.as_deref()),
        What::Wp { ref problem } => wp::bench(&gpu, problem),
    }
}

fn kernels(gpu: &Gpu, json: bool, items: usize, repeats: usize, only: &str) -> Result<(), String> {
    if !json {
        println!(
            "{:<18} {:>8} {:>10} {:>10} {:>8} {:>9} {:>10}",
            "kernel", "items", "µs", "ns/item", "GB/s", "GFLOP/s", "max error"
        );
    }
    if !CASES.iter().any(|c| c.kernel.contains(only)) {
        return Err(format!("no kernel's name holds '{only}'"));
    }
    let mut left_out = Vec::new();
    for case in CASES.iter().filter(|c| c.kernel.contains(only)) {
        // One that does not fit the device at this size does not end the others.
        let r = match harness::time(gpu, case, items, repeats) {
            Ok(r) => r,
            Err(e) => {
                eprintln!("{e}");
                left_out.push(case.kernel);
                continue;
            }
        };
        if json {
            let row = serde_json::json!({
                "kernel": r.kernel, "items": r.items, "us": r.ms * 1e3, "ns_per_item": r.ns, "gb_per_s": r.gigabytes,
                "gflop_per_s": r.gigaflops, "max_relative_error": r.error,
            });
            println!("{row}");
        } else {
            println!(
                "{:<18} {:>8} {:>10.1} {:>10.2} {:>8.2} {:>9.2} {:>10.1e}",
                r.kernel,
                r.items,
                r.ms * 1e3,
                r.ns,
                r.gigabytes,
                r.gigaflops,
                r.error
            );
        }
    }
    if left_out.is_empty() { Ok(()) } else { Err(format!("left out: {}", left_out.join(", "))) }
}

/// Median device time of each kernel of a recording [ms], summed over its calls.
fn stages(gpu: &Gpu, plain: Recording) -> Result<BTreeMap<String, f64>, physvideo_gpu::GpuError> {
    let mut timed = Recording::new("timed");
    for command in plain.commands {
        timed.section(match &command {
            Command::Call { kernel, .. } => kernel.name,
            Command::Fill(..) => "fill",
            _ => "copy",
        });
        timed.commands.push(command);
    }
    let prepared = gpu.prepare(&timed)?;
    let mut all: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for _ in 0..15 {
        let mut once: BTreeMap<String, f64> = BTreeMap::new();
        for t in prepared.submit()? {
            *once.entry(t.section).or_default() += t.ms;
        }
        once.into_iter().for_each(|(name, ms)| all.entry(name).or_default().push(ms));
    }
    let median = |mut ms: Vec<f64>| {
        ms.sort_by(f64::total_cmp);
        ms[ms.len() / 2]
    };
    Ok(all.into_iter().map(|(name, ms)| (name, median(ms))).collect())
}

//! Both elastic solvers on the peers' falling cube, frame by frame in turns, so that what else the machine does meets
//! both alike.

use std::time::Instant;

use physvideo::stages::lagrangian::Lagrangian;
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::stages::solver::Solver;
use physvideo_gpu::{Gpu, Recording};

use crate::{mpm, stages};

/// Times frames of the falling cube, and prints each kernel's part.
pub fn bench(gpu: &Gpu, edge: usize, substeps: u32, repeats: usize) -> Result<(), String> {
    let say = |e: physvideo_gpu::GpuError| e.to_string();
    let mut world = mpm::cube(mpm::Stuff::Elastic, edge, 1.0 / 256.0);
    world.force_dt = None;
    let count = world.bodies[0].positions.len() as f64;
    let mut updated = Mpm::new(gpu, &world, Method::default()).map_err(say)?;
    let mut total = Lagrangian::new(gpu, &world).map_err(|e| e.to_string())?;
    let length = substeps as f32 * world.step();
    let mut times = [Vec::new(), Vec::new()];
    for turn in 0..=repeats.max(1) {
        let frame = |solver: &mut dyn Solver, times: &mut Vec<[f64; 2]>| -> Result<(), String> {
            let begin = Instant::now();
            let stats = solver.frame(length).map_err(say)?;
            let wall = begin.elapsed().as_secs_f64();
            // Drivers compile at the first dispatch.
            if turn > 0 {
                times.push([wall / f64::from(stats.substeps) / count, wall / f64::from(length)]);
            }
            Ok(())
        };
        frame(&mut updated, &mut times[0])?;
        frame(&mut total, &mut times[1])?;
    }
    let median = |of: &[[f64; 2]], i: usize| {
        let mut all: Vec<f64> = of.iter().map(|t| t[i]).collect();
        all.sort_by(f64::total_cmp);
        all[all.len() / 2]
    };
    for (name, times) in ["updated Lagrangian", "total Lagrangian"].iter().zip(&times) {
        println!(
            "{name:<20} {count} particles, {:.1} ns a particle and substep, {:.2} wall seconds a simulated second",
            median(times, 0) * 1e9,
            median(times, 1)
        );
    }
    println!("ratio {:.2} a substep", median(&times[0], 0) / median(&times[1], 0));
    println!("    {} nodes", total.nodes());
    let mut substep = Recording::new("substep");
    total.record_substep(&mut substep);
    total.start_clock(64.0 * world.step()).map_err(say)?;
    for (stage, ms) in stages(gpu, substep).map_err(say)? {
        println!("    {stage:<20} {:>8.1} ns a particle", ms * 1e6 / count);
    }
    Ok(())
}

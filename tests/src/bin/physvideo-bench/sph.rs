//! The whole step of SPH on the peers' dam break: n³ particles of 1.3 cm in a tank of 3 s × s × 2 s.

use std::time::Instant;

use physvideo::fluid::Fluid;
use physvideo::scene::{Material, Pressure, Viscosity};
use physvideo::stages::solver::Solver;
use physvideo::stages::sph::Sph;
use physvideo::world::{Body, World};
use physvideo_gpu::kernels::{Collider, family};
use physvideo_gpu::{Gpu, Recording};

use crate::stages;

/// Particle size of the peers' scene [m].
const SIZE: f32 = 1.3e-2;
/// Step of the peers' scene [s].
const STEP: f32 = 4e-4;

fn dam(side: usize, pressure: Pressure) -> World {
    let s = side as f32 * SIZE;
    let positions: Vec<[f32; 3]> = (0..side.pow(3))
        .map(|i| [i % side, i / side % side, i / (side * side)].map(|c| (c as f32 + 0.5) * SIZE))
        .collect();
    let body = Body {
        name: "water".into(),
        material: Material::Sph { viscosity: 5e-3, surface_tension: 0.0 },
        density: 1000.0,
        velocities: vec![[0.0; 3]; positions.len()],
        pinned: vec![],
        prestress: false,
        friction: 0.2,
        particle_volume: SIZE.powi(3),
        fields: 0,
        gravity: None,
        recycle: None,
        emission: None,
        damping: 0.0,
        positions,
    };
    let tank = Collider {
        shape: family::shape::ROOM,
        end: 1e9,
        center: [1.5 * s, 0.5 * s, s, 0.0],
        size: [1.5 * s, 0.5 * s, s, 0.0],
        ..Default::default()
    };
    World {
        bodies: vec![body],
        gravity: [0.0, 0.0, -9.81],
        fields: vec![],
        colliders: vec![tank],
        domain: ([0.0; 3], [3.0 * s, s, 2.0 * s]),
        dx: 1.0 / 128.0,
        courant: 0.75,
        force_dt: Some(STEP),
        fluid: Fluid { particle_size: SIZE, pressure, ..Default::default() },
    }
}

/// Times frames of the breaking dam, and prints each kernel's part.
pub fn bench(
    gpu: &Gpu,
    pressure: Pressure,
    density_error: f32,
    n: usize,
    steps: u32,
    repeats: usize,
) -> Result<(), String> {
    let say = |e: physvideo_gpu::GpuError| e.to_string();
    let mut world = dam((n as f64).cbrt().round() as usize, pressure);
    world.fluid.density_error = density_error;
    let count = world.bodies[0].positions.len() as f64;
    let mut sph = Sph::new(gpu, &world).map_err(say)?;
    let length = steps as f32 * STEP;
    sph.frame(length).map_err(say)?; // drivers compile at the first dispatch
    let mut times = Vec::new();
    let (mut iterations, mut taken, mut clamps, mut searches) = (0, 0, 0, 0);
    for _ in 0..repeats.max(1) {
        let begin = Instant::now();
        let stats = sph.frame(length).map_err(say)?;
        times.push(begin.elapsed().as_secs_f64() / f64::from(stats.substeps));
        iterations += stats.iterations;
        taken += stats.substeps;
        searches += stats.searches;
        clamps += stats.clamped_velocity + stats.quarantined + stats.clamped_volume + stats.unsolved;
    }
    times.sort_by(f64::total_cmp);
    let (best, median) = (times[0], times[times.len() / 2]);
    let m = sph.measure(0).map_err(say)?;
    println!(
        "{pressure:?}: {count} particles, {:.0} ns a particle and step [best {:.0}], {:.1} iterations a step, {:.2} searches a \
         step, {clamps} limits hit; centre of mass at {:.6} m, kinetic energy {:.3} J after {:.3} s",
        median * 1e9 / count,
        best * 1e9 / count,
        f64::from(iterations) / f64::from(taken.max(1)),
        f64::from(searches) / f64::from(taken.max(1)),
        m.height / m.mass,
        m.kinetic,
        sph.time()
    );
    let mut step = Recording::new("step");
    sph.record_step(&mut step);
    sph.start_clock(STEP * 64.0).map_err(say)?;
    for (stage, ms) in stages(gpu, step).map_err(say)? {
        println!("    {stage:<16} {:>8.1} ns a particle", ms * 1e6 / count);
    }
    Ok(())
}

/// Particles of the honey [m], its viscosity [m²/s], frames of it [s].
const HONEY: (f32, f32, f32) = (4e-3, 7e-3, 0.05);

/// Wall seconds a simulated second of a dam of honey by DFSPH, each way of viscosity in turn.
pub fn honey(gpu: &Gpu, n: usize, repeats: usize) -> Result<(), String> {
    let say = |e: physvideo_gpu::GpuError| e.to_string();
    let mut world = dam((n as f64).cbrt().round() as usize, Pressure::Dfsph);
    let shrink = HONEY.0 / SIZE;
    world.force_dt = None;
    world.bodies[0].material = Material::Sph { viscosity: HONEY.1, surface_tension: 0.0 };
    world.bodies[0].positions.iter_mut().for_each(|x| *x = x.map(|c| c * shrink));
    for c in &mut world.colliders {
        (c.center, c.size) = (c.center.map(|x| x * shrink), c.size.map(|x| x * shrink));
        c.sticky = 1;
    }
    world.domain.1 = world.domain.1.map(|c| c * shrink);
    let ways = [Viscosity::Explicit, Viscosity::Implicit];
    let fluid = |viscosity| Fluid { particle_size: HONEY.0, viscosity, ..world.fluid };
    let mut runs = Vec::new();
    for way in ways {
        runs.push((way, Sph::new(gpu, &World { fluid: fluid(way), ..world.clone() }).map_err(say)?, Vec::new(), 0, 0));
    }
    for turn in 0..=repeats.max(1) {
        for (_, sph, times, steps, iterations) in &mut runs {
            let begin = Instant::now();
            let stats = sph.frame(HONEY.2).map_err(say)?;
            // Drivers compile in the first.
            if turn > 0 {
                times.push(begin.elapsed().as_secs_f64() / f64::from(HONEY.2));
                (*steps, *iterations) = (*steps + stats.substeps, *iterations + stats.iterations);
            }
        }
    }
    for (way, sph, mut times, steps, iterations) in runs {
        times.sort_by(f64::total_cmp);
        let m = sph.measure(0).map_err(say)?;
        println!(
            "honey, {way:?}: {:.1} s a simulated second [best {:.1}], {steps} steps, {:.1} iterations a step; centre of \
             mass at {:.6} m, kinetic energy {:.3e} J",
            times[times.len() / 2],
            times[0],
            f64::from(iterations) / f64::from(steps.max(1)),
            m.height / m.mass,
            m.kinetic
        );
    }
    Ok(())
}

//! The whole MLS-MPM substep on the peers' falling cube.

use std::time::Instant;

use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm, P2g};
use physvideo::world::{Body, World, ground};
use physvideo_gpu::{Gpu, Recording};

use crate::stages;

fn cube(edge: usize, spacing: f32) -> World {
    let mut positions = Vec::new();
    for i in 0..edge.pow(3) {
        let at = [i % edge, i / edge % edge, i / (edge * edge)];
        let x: [f32; 3] = std::array::from_fn(|a| (at[a] as f32 + 0.5) * spacing);
        positions.push([x[0] + 0.3, x[1] + 0.3, x[2] + 0.002]);
    }
    let body = Body {
        name: "cube".into(),
        material: Material::Elastic { young: 8e4, poisson: 0.32 },
        density: 40.0,
        velocities: vec![[0.0; 3]; positions.len()],
        pinned: vec![],
        prestress: false,
        particle_volume: spacing.powi(3),
        fields: 0,
        positions,
    };
    World {
        bodies: vec![body],
        gravity: [0.0, 0.0, -9.81],
        fields: vec![],
        colliders: vec![ground(0.0, 0.2)],
        domain: ([0.0; 3], [1.0; 3]),
        dx: 1.0 / 128.0,
        courant: 0.75,
        force_dt: Some(1e-4),
        fluid: Default::default(),
    }
}

/// Times frames of the falling cube, and prints each kernel's part.
pub fn bench(gpu: &Gpu, edge: usize, spacing: f32, substeps: u32, repeats: usize, all: bool) -> Result<(), String> {
    let say = |e: physvideo_gpu::GpuError| e.to_string();
    let world = cube(edge, spacing);
    let count = world.bodies[0].positions.len() as f64;
    let forms = if all { vec![Some(P2g::Cell), Some(P2g::Fixed), Some(P2g::Float)] } else { vec![None] };
    for p2g in forms {
        let mut mpm = Mpm::new(gpu, &world, Method { p2g, ..Default::default() }).map_err(say)?;
        let length = substeps as f32 * 1e-4;
        mpm.frame(length).map_err(say)?; // drivers compile at the first dispatch
        let mut times = Vec::new();
        for _ in 0..repeats.max(1) {
            let begin = Instant::now();
            let stats = mpm.frame(length).map_err(say)?;
            times.push(begin.elapsed().as_secs_f64() / f64::from(stats.substeps));
        }
        times.sort_by(f64::total_cmp);
        let (best, median) = (times[0], times[times.len() / 2]);
        let m = mpm.measure(0).map_err(say)?;
        println!(
            "{:?}: {count} particles, {:.1} ns a particle and substep [best {:.1}], {:.1} wall seconds a simulated second at dt 1e-4; \
             centre of mass at {:.6} m after {:.3} s",
            mpm.p2g(),
            median * 1e9 / count,
            best * 1e9 / count,
            median / 1e-4,
            m.height / m.mass,
            mpm.time()
        );
        let mut substep = Recording::new("substep");
        mpm.record_substep(&mut substep);
        mpm.start_clock(1e-4 * 64.0).map_err(say)?;
        for (stage, ms) in stages(gpu, substep).map_err(say)? {
            println!("    {stage:<16} {:>8.1} ns a particle", ms * 1e6 / count);
        }
    }
    Ok(())
}

//! The whole MLS-MPM substep on the peers' falling cube.

use std::time::Instant;

use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm, P2g};
use physvideo::world::{Body, World, ground};
use physvideo_gpu::{Gpu, Recording};

use crate::stages;

/// The cube's material, with the peer's (Genesis') defaults where it is not the elastic one of the paper.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub enum Stuff {
    /// E 8e4, ν 0.32, 40 kg/m³.
    Elastic,
    /// The same, neo-Hookean.
    NeoHookean,
    /// The same, yielding at 1 kPa.
    Plastic,
    /// The same, as snow.
    Snow,
    /// E 1e6, ν 0.2, 1000 kg/m³.
    Sand,
    /// K 3.3e5, 1000 kg/m³.
    Liquid,
}

impl Stuff {
    /// Material and density [kg/m³].
    fn body(self) -> (Material, f32) {
        let (young, poisson) = (8e4, 0.32);
        match self {
            Stuff::Elastic => (Material::Elastic { young, poisson }, 40.0),
            Stuff::NeoHookean => (Material::NeoHookean { young, poisson }, 40.0),
            Stuff::Plastic => (Material::Plastic { young, poisson, yield_stress: 1e3, hardening: 0.0 }, 40.0),
            Stuff::Snow => {
                let (critical_compression, critical_stretch, hardening) = (2.5e-2, 4.5e-3, 10.0);
                (Material::Snow { young, poisson, critical_compression, critical_stretch, hardening }, 40.0)
            }
            Stuff::Sand => (Material::Sand { young: 1e6, poisson: 0.2, friction: 1.0 }, 1000.0),
            Stuff::Liquid => (Material::Liquid { bulk: 3.3e5, exponent: 7.0, viscosity: 0.0 }, 1000.0),
        }
    }
}

/// A cube that begins to fall, just above the ground.
pub fn cube(stuff: Stuff, edge: usize, spacing: f32) -> World {
    let (material, density) = stuff.body();
    let mut positions = Vec::new();
    for i in 0..edge.pow(3) {
        let at = [i % edge, i / edge % edge, i / (edge * edge)];
        let x: [f32; 3] = std::array::from_fn(|a| (at[a] as f32 + 0.5) * spacing);
        positions.push([x[0] + 0.3, x[1] + 0.3, x[2] + 0.002]);
    }
    let body = Body {
        name: "cube".into(),
        material,
        density,
        velocities: vec![[0.0; 3]; positions.len()],
        pinned: vec![],
        gravity: None,
        prestress: false,
        friction: 0.2,
        particle_volume: spacing.powi(3),
        fields: 0,
        recycle: None,
        emission: None,
        damping: 0.0,
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
pub fn bench(
    gpu: &Gpu,
    stuff: Stuff,
    edge: usize,
    spacing: f32,
    substeps: u32,
    repeats: usize,
    all: bool,
) -> Result<(), String> {
    let say = |e: physvideo_gpu::GpuError| e.to_string();
    let world = cube(stuff, edge, spacing);
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
            "{stuff:?}, {:?}: {count} particles, {:.1} ns a particle and substep [best {:.1}], {:.1} wall seconds a simulated second at dt 1e-4; \
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

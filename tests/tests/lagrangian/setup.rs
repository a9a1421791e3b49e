//! Worlds for elastic bodies on grids of their own, and what is measured of them.

use physvideo::scene::Material;
use physvideo::stages::lagrangian::Lagrangian;
use physvideo::stages::solver::Solver;
use physvideo::world::{Body, World};
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Particle;

/// Eight particles a cell at the places of the box [low, high) that `keep` keeps [m].
pub fn fill(dx: f64, low: [f64; 3], high: [f64; 3], keep: impl Fn([f64; 3]) -> bool) -> Vec<[f32; 3]> {
    let s = dx / 2.0;
    let n: [usize; 3] = std::array::from_fn(|a| ((high[a] - low[a]) / s).round() as usize);
    let all = (0..n.iter().product()).map(|i| [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])]);
    let places = all.map(|at| std::array::from_fn(|a| low[a] + (at[a] as f64 + 0.5) * s));
    places.filter(|x| keep(*x)).map(|x| x.map(|c| c as f32)).collect()
}

pub fn body(
    (young, poisson): (f64, f64),
    density: f64,
    dx: f64,
    positions: Vec<[f32; 3]>,
    velocity: impl Fn([f32; 3]) -> [f32; 3],
) -> Body {
    Body {
        name: "body".into(),
        material: Material::Elastic { young: young as f32, poisson: poisson as f32 },
        density: density as f32,
        velocities: positions.iter().map(|x| velocity(*x)).collect(),
        pinned: vec![],
        prestress: false,
        friction: 0.2,
        gravity: None,
        recycle: None,
        emission: None,
        damping: 0.0,
        particle_volume: (dx / 2.0).powi(3) as f32,
        fields: u32::MAX >> 1,
        positions,
    }
}

pub fn world(bodies: Vec<Body>, dx: f64) -> World {
    World {
        bodies,
        gravity: [0.0; 3],
        fields: vec![],
        colliders: vec![],
        domain: ([-50.0; 3], [50.0; 3]),
        dx: dx as f32,
        courant: 0.75,
        force_dt: None,
        fluid: Default::default(),
    }
}

pub fn solver<'g>(gpu: &'g Gpu, world: &World) -> Lagrangian<'g> {
    Lagrangian::new(gpu, world).unwrap()
}

pub fn particles(gpu: &Gpu, solver: &Lagrangian) -> Vec<Particle> {
    gpu.read(solver.particles()).unwrap()
}

/// Mean position of the particles that `keep` keeps by their index, in f64.
pub fn center(all: &[Particle], keep: impl Fn(usize) -> bool) -> [f64; 3] {
    let kept: Vec<_> = all.iter().enumerate().filter(|(i, _)| keep(*i)).map(|(_, p)| p).collect();
    std::array::from_fn(|a| kept.iter().map(|p| f64::from(p.x[a])).sum::<f64>() / kept.len() as f64)
}

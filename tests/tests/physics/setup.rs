//! Worlds of the problems: blocks of particles on a lattice, planes, and what is measured of them.

use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::world::{Body, World};
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Collider;

/// Eight particles a cell at `keep`-worthy places of the box [low, high).
pub fn fill(dx: f64, low: [f64; 3], high: [f64; 3], keep: impl Fn([f64; 3]) -> bool) -> Vec<[f32; 3]> {
    let s = dx / 2.0;
    let n: [usize; 3] = std::array::from_fn(|a| ((high[a] - low[a]) / s).round() as usize);
    let mut out = Vec::new();
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                let x = [i, j, k];
                let x: [f64; 3] = std::array::from_fn(|a| low[a] + (x[a] as f64 + 0.5) * s);
                if keep(x) {
                    out.push(x.map(|c| c as f32));
                }
            }
        }
    }
    out
}

pub fn body(
    material: Material,
    density: f64,
    dx: f64,
    positions: Vec<[f32; 3]>,
    velocity: impl Fn([f32; 3]) -> [f32; 3],
) -> Body {
    Body {
        name: "body".into(),
        material,
        density: density as f32,
        velocities: positions.iter().map(|x| velocity(*x)).collect(),
        pinned: vec![],
        prestress: false,
        particle_volume: (dx / 2.0).powi(3) as f32,
        fields: u32::MAX >> 1,
        positions,
    }
}

pub fn world(bodies: Vec<Body>, dx: f64, low: [f64; 3], high: [f64; 3]) -> World {
    World {
        bodies,
        gravity: [0.0; 3],
        fields: vec![],
        colliders: vec![],
        domain: (low.map(|c| c as f32), high.map(|c| c as f32)),
        dx: dx as f32,
        courant: 0.75,
        force_dt: None,
        fluid: Default::default(),
    }
}

/// A frictionless or sticking half space.
pub fn plane(point: [f64; 3], normal: [f32; 3], sticky: bool) -> Collider {
    Collider {
        shape: 1,
        sticky: u32::from(sticky),
        end: 1e9,
        center: [point[0] as f32, point[1] as f32, point[2] as f32, 0.0],
        size: [normal[0], normal[1], normal[2], 0.0],
        ..Default::default()
    }
}

/// Two frictionless planes that hold a slab of `cells` cells from z = 0 in plane strain, a quarter cell outside it.
pub fn between(dx: f64, cells: f64) -> [Collider; 2] {
    [
        plane([0.0, 0.0, 0.25 * dx], [0.0, 0.0, 1.0], false),
        plane([0.0, 0.0, (cells - 0.25) * dx], [0.0, 0.0, -1.0], false),
    ]
}

pub fn solver<'g>(gpu: &'g Gpu, world: &World, true_gradient: bool) -> Mpm<'g> {
    Mpm::new(gpu, world, Method { true_gradient, ..Default::default() }).unwrap()
}

/// Mean position of the particles, in f64.
pub fn center(gpu: &Gpu, mpm: &Mpm) -> [f64; 3] {
    let particles = gpu.read(mpm.particles).unwrap();
    let n = particles.len() as f64;
    std::array::from_fn(|a| particles.iter().map(|p| f64::from(p.x[a])).sum::<f64>() / n)
}

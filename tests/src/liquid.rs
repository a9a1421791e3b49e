//! Worlds of liquids for tests and problems: boxes of water on a lattice, walls, what is measured of them.

use physvideo::fluid::Fluid;
use physvideo::scene::{Material, Pressure};
use physvideo::world::{Body, World};
use physvideo_gpu::kernels::{Collider, family};

/// Points of the lattice of spacing `h` (half a spacing inside) in the box [low, high).
pub fn lattice(h: f64, low: [f64; 3], high: [f64; 3]) -> Vec<[f32; 3]> {
    let n: [usize; 3] = std::array::from_fn(|a| ((high[a] - low[a]) / h).round() as usize);
    (0..n.iter().product())
        .map(|i| {
            let at = [i % n[0], i / n[0] % n[1], i / (n[0] * n[1])];
            std::array::from_fn(|a| (low[a] + (at[a] as f64 + 0.5) * h) as f32)
        })
        .collect()
}

/// A liquid at rest.
pub fn liquid(density: f32, viscosity: f32, h: f64, positions: Vec<[f32; 3]>) -> Body {
    Body {
        name: "liquid".into(),
        material: Material::Sph { viscosity, surface_tension: 0.0 },
        density,
        velocities: vec![[0.0; 3]; positions.len()],
        pinned: vec![],
        prestress: false,
        friction: 0.2,
        particle_volume: h.powi(3) as f32,
        fields: u32::MAX >> 1,
        gravity: None,
        recycle: None,
        emission: None,
        damping: 0.0,
        positions,
    }
}

/// A world of liquids without gravity, fields or walls.
pub fn world(pressure: Pressure, h: f64, bodies: Vec<Body>, low: [f64; 3], high: [f64; 3]) -> World {
    World {
        bodies,
        gravity: [0.0; 3],
        fields: vec![],
        colliders: vec![],
        domain: (low.map(|c| c as f32), high.map(|c| c as f32)),
        dx: 1.0 / 128.0,
        courant: 0.75,
        force_dt: None,
        fluid: Fluid { particle_size: h as f32, pressure, ..Default::default() },
    }
}

/// A room between two corners, without friction.
pub fn room(low: [f64; 3], high: [f64; 3]) -> Collider {
    let at =
        |f: fn(f64, f64) -> f64| [f(low[0], high[0]) as f32, f(low[1], high[1]) as f32, f(low[2], high[2]) as f32, 0.0];
    Collider {
        shape: family::shape::ROOM,
        end: 1e9,
        center: at(|l, h| 0.5 * (l + h)),
        size: at(|l, h| 0.5 * (h - l)),
        ..Default::default()
    }
}

/// A half space whose surface goes through `point`.
pub fn plane(point: [f64; 3], normal: [f32; 3], sticky: bool) -> Collider {
    Collider {
        shape: family::shape::PLANE,
        sticky: sticky.into(),
        end: 1e9,
        center: [point[0] as f32, point[1] as f32, point[2] as f32, 0.0],
        size: [normal[0], normal[1], normal[2], 0.0],
        ..Default::default()
    }
}

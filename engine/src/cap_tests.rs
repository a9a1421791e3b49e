use super::*;
use crate::scene::{Force, Material};
use crate::world::ground;

/// A cube of 0.2 m, 500 kg/m³, that starts `up` metres above the domain's bottom, on a lattice of 0.1 m.
fn cube(up: f32, material: Material) -> Body {
    let corner = |i: usize| [i & 1, i >> 1 & 1, i >> 2].map(|c| 0.05 + 0.1 * c as f32);
    let place = |i| {
        let [x, y, z] = corner(i);
        [x, y, z + up]
    };
    Body {
        name: "cube".into(),
        material,
        density: 500.0,
        positions: (0..8).map(place).collect(),
        particle_volume: 1e-3,
        velocities: vec![[0.0; 3]; 8],
        pinned: vec![],
        gravity: None,
        prestress: false,
        friction: 0.2,
        fields: 0,
        recycle: None,
        emission: None,
        damping: 0.0,
    }
}

const STIFF: Material = Material::Elastic { young: 1e9, poisson: 0.3 };

/// Over a domain of 2 × 2 × 1 m whose diagonal is 3 m; gravity 10 m/s².
fn world(body: Body) -> World {
    World {
        bodies: vec![body],
        gravity: [0.0, 0.0, -10.0],
        fields: vec![],
        colliders: vec![],
        domain: ([-1.0, -1.0, 0.0], [1.0, 1.0, 1.0]),
        dx: 0.2,
        courant: 0.75,
        force_dt: None,
        fluid: Default::default(),
    }
}

fn needed(world: &World, share: f32) -> f64 {
    f64::from(Expected::of(world).modulus(&world.bodies[0], share).unwrap())
}

fn near(found: f64, by_hand: f64) {
    assert!((found / by_hand - 1.0).abs() < 1e-4, "{found} for {by_hand}");
}

#[test]
fn a_fall_needs_so_much() {
    // Its lowest particles fall 0.45 m: ρ v²/ε² = 500 · 9 / 0.01; ρ g L/ε = 500 · 10 · 0.2 / 0.1 is less.
    let mut w = world(cube(0.4, STIFF));
    near(needed(&w, 0.1), 4.5e5);
    // On ground at 0.2 m: 0.25 m, v² = 5. A plane above it, one that moves and one that ends catch nothing.
    w.colliders = vec![ground(0.2, 0.5), ground(0.8, 0.5)];
    near(needed(&w, 0.1), 2.5e5);
    w.colliders[0].end = 3.0;
    near(needed(&w, 0.1), 4.5e5);
    // Thrown at 4 m/s: v² = 9 + 16, wherever it goes.
    w.bodies[0].velocities[3] = [0.0, 0.0, 4.0];
    near(needed(&w, 0.1), 500.0 * 25.0 / 0.01);
}

#[test]
fn a_weight_needs_so_much() {
    // 0.05 m above the ground by its particles: v² = 1, and at ε = 0.5 the weight counts no less than 500 · 10 · 0.2 / 0.5.
    let mut w = world(cube(0.0, STIFF));
    near(needed(&w, 0.5), 2e3);
    w.colliders = vec![ground(0.05, 0.5)];
    near(needed(&w, 0.5), 2e3);
    // A second cube may stand on it, and a denser one fall on it from no height.
    w.bodies.push(Body { density: 1000.0, ..cube(0.0, STIFF) });
    near(needed(&w, 0.5), 6e3);
}

#[test]
fn what_is_held_is_pressed_and_bent() {
    // A bar of 0.8 × 0.2 × 0.2 m held at one end is 4 times as long as thick: 16 · max(500 · 2 · 10 · 0.8 / ε², …).
    let mut body = cube(0.4, STIFF);
    let at = |i: usize| [0.1 * (i / 4) as f32, 0.1 * (i & 1) as f32, 0.1 * (i >> 1 & 1) as f32];
    body.positions = (0..32).map(|i| at(i).map(|c| c + 0.05)).collect();
    body.velocities = vec![[0.0; 3]; 32];
    body.pinned = (0..32).map(|i| i < 4).collect();
    let mut w = world(body);
    near(needed(&w, 0.5), 16.0 * 500.0 * 16.0 / 0.25);
    // Its weight is carried from the start: nothing loads it, until a force of 3 m/s² does: v² = 2 · 3 · 3, ρ a L = 1200.
    w.bodies[0].prestress = true;
    assert_eq!(Expected::of(&w).modulus(&w.bodies[0], 0.5), None);
    w.fields = vec![kernels::Field::default()];
    Force::Uniform { acceleration: [0.0, 3.0, 0.0] }.write([0.0; 2], &mut w.fields[0]);
    near(needed(&w, 0.5), 16.0 * 500.0 * 18.0 / 0.25);
}

#[test]
fn winds_and_obstacles_count() {
    let mut w = world(cube(0.0, STIFF));
    w.gravity = [0.0; 3];
    assert_eq!(Expected::of(&w).modulus(&w.bodies[0], 0.1), None, "nothing moves");
    w.fields = vec![kernels::Field::default()];
    Force::Wind { velocity: [0.0, 2.0, 0.0], drag: 1.0, gust: 0.5, frequency: 1.0 }.write([0.0; 2], &mut w.fields[0]);
    near(needed(&w, 0.1), 500.0 * 9.0 / 0.01);
    // A hard wind presses more than it moves: ρ · 1000 · 3 · 0.2 / 0.1.
    w.fields[0].p0 = 1000.0;
    near(needed(&w, 0.1), 3e6);
    // A ball of 0.5 m that comes at 1 m/s and turns at 4 rad/s: 3 m/s at its rim, on top of the wind.
    w.fields[0].p0 = 1.0;
    let ball = kernels::Collider {
        shape: shape::BALL,
        size: [0.5, 0.0, 0.0, 0.0],
        velocity: [1.0, 0.0, 0.0, 0.0],
        spin: [0.0, 4.0, 0.0, 0.0],
        ..Default::default()
    };
    w.colliders = vec![ball];
    near(needed(&w, 0.1), 500.0 * 36.0 / 0.01);
}

#[test]
fn only_what_is_elastic_and_too_stiff_is_softened() {
    let mut w = world(cube(0.4, STIFF));
    let step = w.step();
    let capped = apply(0.1, &mut w);
    assert_eq!(capped.len(), 1);
    near(f64::from(capped[0].effective), 4.5e5);
    near(f64::from(w.bodies[0].material.young().unwrap()), 4.5e5);
    // Steps grow by the root.
    near(f64::from(w.step() / step), (1e9f64 / 4.5e5).sqrt());
    let line = capped[0].line();
    assert!(line.contains("4.500e5 Pa instead of 1.000e9 Pa, 2.222e3 times as soft") && line.contains("47.1 times"));
    assert!(apply(0.1, &mut w).is_empty(), "it is soft enough now");
    let plastic = Material::Plastic { young: 1e9, poisson: 0.3, yield_stress: 2e3, hardening: 0.0 };
    let sand = Material::Sand { young: 1e9, poisson: 0.3, friction: 0.6 };
    for stays in [plastic, sand, Material::Liquid { bulk: 1e9, exponent: 7.0, viscosity: 0.0 }] {
        let mut w = world(cube(0.4, stays));
        assert!(apply(0.1, &mut w).is_empty() && w.bodies[0].material == stays);
    }
}

/// A front of what flows, 0.2 m high: 2 √(g H) = 2 √2. What keeps its shape has none.
#[test]
fn a_front_is_as_fast_as_its_height_allows() {
    let water = Material::Sph { viscosity: 1e-3, surface_tension: 0.0 };
    near(front(&world(cube(0.4, water))), 8f64.sqrt());
    assert_eq!(front(&world(cube(0.4, STIFF))), 0.0);
}

//! A ball stands in the middle of a lattice of its own, wherever it is: it comes down on a cap, and goes up again as it came.

use physvideo::assemble::{Inputs, assemble};
use physvideo::geometry::Lattice;
use physvideo::plan::Plan;
use physvideo::scene::{Until, parse};
use physvideo::world::World;
use physvideo_gpu::Gpu;
use physvideo_tests::device::gpu;

use super::setup::{center, particles, solver};

const CENTER: [f32; 3] = [0.18, 0.06, 0.2];
const RADIUS: f32 = 0.13;

fn scene() -> World {
    let text = format!(
        "simulation.grid_density = 32
         [ground]
         friction = 0.4
         [[object]]
         name = 'ball'
         source.ball = {{ center = {CENTER:?}, radius = {RADIUS} }}
         material.elastic = {{ young = 5e4, poisson = 0.3 }}
         density = 500.0"
    );
    let scene = parse(&text, "ball.toml").unwrap();
    assemble(&scene, &Inputs::default(), &Plan::new(&scene, Until::State)).unwrap().world
}

/// How far it is to the side after a second and a half, some bounces of 7 cm [m].
fn aside(gpu: &Gpu, world: &World) -> f64 {
    let mut s = solver(gpu, world);
    let begun = center(&particles(gpu, &s), |_| true);
    s.frame(1.5).unwrap();
    let now = center(&particles(gpu, &s), |_| true);
    drop(s);
    gpu.free_arena("run");
    (now[0] - begun[0]).hypot(now[1] - begun[1])
}

#[test]
fn a_ball_bounces_straight() {
    let gpu = gpu();
    let world = scene();
    let n = world.bodies[0].positions.len() as f32;
    let sum = world.bodies[0].positions.iter().fold([0.0; 3], |s, x| [0, 1, 2].map(|a| s[a] + (x[a] - CENTER[a])));
    assert!(sum.iter().all(|c| (c / n).abs() < 1e-5), "its middle is {sum:?} / {n} off");
    let own = aside(&gpu, &world);
    // Control: cut from the lattice of all.
    let mut other = world.clone();
    let spacing = other.dx / 2.0;
    let ball = Lattice { spacing }.fill_ball("ball", CENTER, RADIUS, [0.5; 3]).unwrap();
    let body = &mut other.bodies[0];
    (body.velocities, body.pinned) = (vec![[0.0; 3]; ball.positions.len()], vec![false; ball.positions.len()]);
    body.positions = ball.positions;
    let shared = aside(&gpu, &other);
    println!("to the side: {own:.5} m, {shared:.5} m on the lattice of all");
    assert!(own < 1e-3 && shared > 5.0 * own.max(1e-3), "{own} m, {shared} m on the lattice of all");
}

//! Emitters of SPH: a jet has the mass of its flow and the density of the liquid, against gravity too; what drains comes
//! out again; what is not out costs nothing.

use physvideo::assemble::{Inputs, assemble};
use physvideo::plan::Plan;
use physvideo::scene::{Until, parse};
use physvideo::stages::solver::{DORMANT, FrameStats};
use physvideo::stages::sph::Sph;
use physvideo::world::World;
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Particle;
use physvideo_tests::device::gpu;

/// Particles 1 cm apart; a nozzle of 4 × 4, two deep, whose end is at the origin, blows up at 1 m/s.
fn jet(gravity: f32, emitter: &str, more: &str) -> World {
    let text = format!(
        "gravity = [0, 0, {gravity}]
         [simulation]
         particle_size = 0.01
         domain = {{ min = [-0.2, -0.2, -0.2], max = [0.2, 0.2, 0.8] }}
         [output]
         until = 'state'
         frames = 60
         fps = 50
         [[object]]
         name = 'jet'
         source.box = {{ min = [-0.02, -0.02, -0.02], max = [0.02, 0.02, 0] }}
         material.sph = {{ viscosity = 1e-6 }}
         density = 1000
         velocity = [0, 0, 1]
         emitter = {emitter}
         {more}"
    );
    let scene = parse(&text, "jet.toml").unwrap();
    assemble(&scene, &Inputs::default(), &Plan::new(&scene, Until::State)).unwrap().world
}

/// What happened in each frame, the mass that is out after it, the particles at the end.
fn play(gpu: &Gpu, world: &World, frames: usize) -> (Vec<FrameStats>, Vec<f64>, Vec<Particle>) {
    let mut sph = Sph::new(gpu, world).unwrap();
    let (mut stats, mut mass) = (Vec::new(), Vec::new());
    for _ in 0..frames {
        stats.push(sph.frame(0.02).unwrap());
        mass.push(sph.measure(0).unwrap().mass);
    }
    let out = gpu.read(sph.particles).unwrap().into_iter().filter(|p| p.tag & DORMANT == 0);
    (stats, mass, out.collect())
}

fn densest(particles: &[Particle]) -> f64 {
    particles.iter().map(|p| f64::from(p.s[0]) - 1.0).fold(f64::MIN, f64::max)
}

#[test]
fn a_jet_has_the_mass_and_the_density_of_its_flow() {
    let gpu = gpu();
    let world = jet(-9.81, "{ start = 0.04 }", "");
    let (stats, mass, out) = play(&gpu, &world, 7);
    assert!(stats[..2].iter().all(|idle| (idle.groups, idle.substeps, idle.emitted) == (0, 0, 0)));
    // ρ A v t, to the layer that is just leaving, 1 cm of it.
    let flow = 1000.0 * 0.04 * 0.04;
    assert!((mass[6] - flow * 0.1).abs() < 1.01 * flow * 0.01, "{} kg for {}", mass[6], flow * 0.1);
    // What the nozzle gives to the jet, which it blows against gravity, is no gain.
    assert!(stats.iter().all(|s| (s.quarantined, s.clamped_velocity, s.gained) == (0, 0, 0)));
    // Gravity slows it down behind the nozzle: 0.1 m/s a frame, by which it spreads; as dense as any of the liquid.
    assert!(densest(&out) < 5e-3, "s exceeds 1 by {:.1e}", densest(&out));
    assert!(out.iter().any(|p| p.v[2] < 0.5), "it does not feel its weight");
    // Control: twice as many as fit through are too dense.
    let mut crowded = world;
    let emission = crowded.bodies[0].emission.as_mut().unwrap();
    emission.period /= 2.0;
    emission.delays.iter_mut().for_each(|d| *d /= 2.0);
    assert!(densest(&play(&gpu, &crowded, 4).2) > 0.1);
}

#[test]
fn what_drains_comes_out_again() {
    let gpu = gpu();
    let drain = "recycle = { region.box = { min = [-1, -1, 0.2], max = [1, 1, 1] } }";
    let world = jet(0.0, "{}", drain);
    let (stats, mass, out) = play(&gpu, &world, 50);
    // A second of flow: 1600 particles from a pool; 20 layers of 16 fit below the drain, and those of a frame behind.
    let emitted: u32 = stats.iter().map(|s| s.emitted).sum();
    let recycled: u32 = stats.iter().map(|s| s.recycled).sum();
    assert!((emitted as i32 - 1600).abs() <= 16, "{emitted} left in a second");
    assert_eq!(emitted - recycled, out.len() as u32);
    assert!((mass[49] - 1000.0 * 0.04 * 0.04 * 0.2).abs() < 1.6e-2 * 2.0, "{} kg are out", mass[49]);
    // They are the same few hundred again and again: five groups of 64 and those that a drain leaves partly filled.
    assert!(stats.iter().all(|s| s.groups <= 8 && s.quarantined + s.gained == 0), "{} groups", stats[49].groups);
    assert!(densest(&out) < 5e-3, "s exceeds 1 by {:.1e}", densest(&out));
    let (again, _, same) = play(&gpu, &world, 15);
    assert_eq!(again, stats[..15]);
    assert_eq!(same, play(&gpu, &world, 15).2);
}

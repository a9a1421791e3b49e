//! Emitters: a jet has the mass, the front and the spacing of its rate, an idle one costs nothing, a pool is used again.

use physvideo::assemble::{Assembled, Inputs, assemble};
use physvideo::plan::Plan;
use physvideo::scene::{Until, parse};
use physvideo::stages::mpm::{DORMANT, Method, Mpm};
use physvideo::stages::solver::FrameStats;
use physvideo::world::World;
use physvideo_gpu::kernels::Particle;
use physvideo_gpu::{Gpu, kernels};
use physvideo_tests::device::gpu;

/// A nozzle of 4 × 4 cells, two deep, that blows along x at 1 m/s, in frames of 1/20 s.
fn jet(emitter: &str, frames: u32) -> Result<Assembled, String> {
    let text = format!(
        "gravity = [0, 0, 0]
         [simulation]
         grid_density = 32
         domain = {{ min = [-0.5, -0.25, -0.25], max = [1.5, 0.5, 0.5] }}
         [output]
         until = 'state'
         frames = {frames}
         fps = 20
         [[object]]
         name = 'jet'
         source.box = {{ min = [0, 0, 0], max = [0.0625, 0.125, 0.125] }}
         material.elastic = {{ young = 1000, poisson = 0.3 }}
         density = 100
         velocity = [1, 0, 0]
         emitter = {emitter}"
    );
    let scene = parse(&text, "jet.toml").map_err(|e| e.to_string())?;
    let plan = Plan::new(&scene, Until::State);
    assemble(&scene, &Inputs::default(), &plan).map_err(|e| e.message)
}

/// Frames of 1/20 s: what happened in each, the mass out after each, the particles at the end.
fn play(gpu: &Gpu, world: &World, frames: usize) -> (Vec<FrameStats>, Vec<f64>, Vec<Particle>) {
    let mut mpm = Mpm::new(gpu, world, Method::default()).unwrap();
    let (mut stats, mut mass) = (Vec::new(), Vec::new());
    for _ in 0..frames {
        stats.push(mpm.frame(0.05).unwrap());
        mass.push(mpm.measure(0).unwrap().mass);
    }
    let out = gpu.read(mpm.particles).unwrap().into_iter().filter(|p| p.tag & DORMANT == 0);
    (stats, mass, out.collect())
}

/// Least distance between two particles [spacings].
fn closest(particles: &[Particle], spacing: f32) -> f32 {
    let apart = |a: &kernels::Particle, b: &kernels::Particle| {
        (0..3).map(|i| (a.x[i] - b.x[i]).powi(2)).sum::<f32>().sqrt() / spacing
    };
    let pairs = particles.iter().enumerate().flat_map(|(i, a)| particles[..i].iter().map(move |b| apart(a, b)));
    pairs.fold(f32::MAX, f32::min)
}

#[test]
fn a_jet_has_the_mass_and_the_spacing_of_its_flow() {
    let gpu = gpu();
    let world = jet("{ start = 0.1 }", 20).unwrap().world;
    let (stats, mass, out) = play(&gpu, &world, 14);
    // Before it starts nothing is dispatched, and no step is taken.
    for idle in &stats[..2] {
        assert_eq!((idle.groups, idle.substeps, idle.emitted), (0, 0, 0));
    }
    assert_eq!(mass[1], 0.0);
    // ρ A v t, to the layer that is just leaving: 100 · 0.125² · (0.7 − 0.1) kg, a layer 1/64 m.
    let flow = 100.0 * 0.125 * 0.125;
    assert!((mass[13] - flow * 0.6).abs() < flow / 64.0, "{} kg for {}", mass[13], flow * 0.6);
    // The front has gone 0.6 m from where its first layer left, the middle of the last half cell of the nozzle.
    let front = out.iter().map(|p| p.x[0]).fold(0.0, f32::max);
    assert!((front - (0.0625 - 1.0 / 128.0 + 0.6)).abs() < 1e-3, "front at {front}");
    // Nothing meets anything: layers follow one another at the spacing of the lattice.
    let near = closest(&out, 1.0 / 64.0);
    assert!((near - 1.0).abs() < 1e-2, "{near} spacings");
    assert!(out.iter().all(|p| (p.v[0] - 1.0).abs() < 1e-3 && p.v[1].abs() < 1e-3));
    // Groups grow with what is out: 64 particles a layer of 8 × 8.
    assert!(stats[3].groups < stats[13].groups && stats[13].groups as usize <= out.len() / 64 + 2, "{stats:?}");
    // Control: twice as many as fit through meet.
    let mut crowded = world;
    let emission = crowded.bodies[0].emission.as_mut().unwrap();
    emission.period /= 2.0;
    emission.delays.iter_mut().for_each(|d| *d /= 2.0);
    let (_, _, out) = play(&gpu, &crowded, 5);
    assert!(closest(&out, 1.0 / 64.0) < 0.6);
}

#[test]
fn a_rate_is_kept_and_a_pool_used_again() {
    let gpu = gpu();
    // Half of what fits through; each particle is there for 0.2 s.
    let half = 0.5 * 100.0 * 0.125 * 0.125;
    let world = jet(&format!("{{ rate = {half}, lifetime = 0.2 }}"), 100).unwrap().world;
    let (stats, mass, out) = play(&gpu, &world, 40);
    let emitted: u32 = stats.iter().map(|s| s.emitted).sum();
    let pool = world.bodies[0].positions.len();
    assert!(emitted as usize > 2 * pool, "{emitted} particles from a pool of {pool}");
    let each = mass[39] / out.len() as f64;
    // Copies of 4 layers: what was emitted is the rate's to one of them.
    let copy = 256.0 * each;
    assert!((f64::from(emitted) * each - half * 2.0).abs() <= copy, "{} kg in 2 s", f64::from(emitted) * each);
    // What is out at the end of a frame was let out within the last 0.2 s and a frame.
    assert!((mass[39] - half * 0.225).abs() <= copy + half * 0.025, "{} kg are out", mass[39]);
    assert!(stats.iter().all(|s| s.quarantined == 0));
    // Two runs have the same bits.
    assert_eq!(play(&gpu, &world, 6).2, play(&gpu, &world, 6).2);
}

#[test]
fn what_cannot_leave_is_refused() {
    let told = |emitter: &str| jet(emitter, 20).err().unwrap_or_default();
    let most = told("{ rate = 3.2 }");
    assert!(most.contains("at most 1.5625 kg/s fit through at this speed"), "{most}");
    assert!(told("{ start = 2, end = 1 }").contains("end 1 is not after start 2"));
}

//! What is left out costs nothing: a wider domain, bodies and parts of bodies that do not move. Runs are taken in turns, so that their ratios
//! hold.

use std::time::Instant;

use physvideo::scene::Material;
use physvideo::stages::mpm::{Method, Mpm};
use physvideo::world::{Body, World};
use physvideo_gpu::Gpu;
use physvideo_gpu::kernels::Field;
use physvideo_gpu::kernels::family::field::UNIFORM;

/// Bodies of a run.
const BODIES: usize = 10;
/// Particles along an edge of each.
const EDGE: usize = 16;
/// Frames of 50 substeps before those that count: drivers compile, what is at rest is seen to be.
const BEFORE: usize = 110;

/// Cubes far apart without weight; `moving` of them spin. `wide`: twice the domain along each axis.
fn cubes(moving: usize, wide: bool) -> World {
    let spacing = 1.0 / 256.0;
    let bodies = (0..BODIES).map(|i| {
        let corner = [0.2 * (i % 5) as f32, 0.2 * (i / 5) as f32, 0.1];
        let local = |k: usize| [k % EDGE, k / EDGE % EDGE, k / (EDGE * EDGE)].map(|c| (c as f32 + 0.5) * spacing);
        let half = 0.5 * EDGE as f32 * spacing;
        let spin = if i < moving { 4.0 } else { 0.0 };
        let offsets: Vec<[f32; 3]> = (0..EDGE.pow(3)).map(local).collect();
        Body {
            name: format!("cube {i}"),
            material: Material::Elastic { young: 8e4, poisson: 0.32 },
            density: 40.0,
            velocities: offsets.iter().map(|x| [-spin * (x[1] - half), spin * (x[0] - half), 0.0]).collect(),
            pinned: vec![],
            gravity: None,
            prestress: false,
            friction: 0.2,
            particle_volume: f32::powi(spacing, 3),
            fields: 0,
            recycle: None,
            emission: None,
            damping: 0.0,
            positions: offsets.iter().map(|x| std::array::from_fn(|a| x[a] + corner[a])).collect(),
        }
    });
    let size = if wide { 2.0 } else { 1.0 };
    World {
        bodies: bodies.collect(),
        gravity: [0.0; 3],
        fields: vec![],
        colliders: vec![],
        domain: ([-0.1; 3], [1.0, 0.5, 0.3].map(|c| c * size)),
        dx: 1.0 / 128.0,
        courant: 0.75,
        force_dt: Some(1e-4),
        fluid: Default::default(),
    }
}

/// The same cubes side by side as one bar; a push too weak to be seen keeps the first awake.
fn bar() -> World {
    let mut world = cubes(0, false);
    let mut bar = world.bodies.swap_remove(0);
    let edge = EDGE as f32 / 256.0;
    let beside = |i: usize| move |x: &[f32; 3]| [x[0] + i as f32 * edge, x[1], x[2]];
    bar.positions = (0..BODIES).flat_map(|i| bar.positions.iter().map(beside(i)).collect::<Vec<_>>()).collect();
    bar.velocities = vec![[0.0; 3]; bar.positions.len()];
    bar.fields = 1;
    let push = Field { kind: UNIFORM, region: 1, end: 1e9, a: [0.0, 0.0, 1e-3, 0.0], ..Default::default() };
    world.fields = vec![Field { region_min: [-1.0; 4], region_max: [0.9 * edge, 1.0, 1.0, 1.0], ..push }];
    world.bodies = vec![bar];
    world
}

/// Prints the time of a substep of each run, and the ratio to the run it is to be held against.
pub fn bench(gpu: &Gpu, repeats: usize) -> Result<(), String> {
    let say = |e: physvideo_gpu::GpuError| e.to_string();
    // Those marked so leave out what is at rest.
    let runs = [
        ("all of 10 bodies move", cubes(BODIES, false), false),
        ("domain 8 times as large", cubes(BODIES, true), false),
        ("one moves", cubes(1, false), false),
        ("half of them move, sleep", cubes(BODIES / 2, false), true),
        ("one moves, sleep", cubes(1, false), true),
        ("a bar", bar(), false),
        ("a tenth of a bar moves, sleep", bar(), true),
    ];
    let mut solvers = Vec::new();
    for (_, world, sleep) in &runs {
        let mut mpm = Mpm::new(gpu, world, Method { sleep: *sleep, ..Method::default() }).map_err(say)?;
        for _ in 0..if *sleep { BEFORE } else { 4 } {
            mpm.frame(50e-4).map_err(say)?;
        }
        solvers.push((mpm, Vec::new(), (0, 0)));
    }
    for _ in 0..repeats.max(1) {
        for (mpm, times, (worked, asleep)) in &mut solvers {
            let begin = Instant::now();
            let stats = mpm.frame(50e-4).map_err(say)?;
            times.push(begin.elapsed().as_secs_f64() / f64::from(stats.substeps));
            (*worked, *asleep) = (stats.groups, stats.asleep);
        }
    }
    let median = |times: &[f64]| {
        let mut sorted = times.to_vec();
        sorted.sort_by(f64::total_cmp);
        sorted[sorted.len() / 2]
    };
    let first = median(&solvers[0].1);
    for ((what, _, _), (_, times, (worked, asleep))) in runs.iter().zip(&solvers) {
        let t = median(times);
        let ms = t * 1e3;
        println!(
            "{what:<30} {ms:>8.3} ms a substep, {:>5.2} of the first; {asleep:>6} particles asleep, {worked:>4} groups of 64 worked on",
            t / first
        );
    }
    Ok(())
}

//! A hundred thousand returns to the source: the known rate, nothing lost, nothing drifting, same bits.

use physvideo::scene::Material;
use physvideo::stages::mpm::QUARANTINED;
use physvideo::world::{Body, World};
use physvideo_gpu::kernels::{Particle, Return};
use physvideo_gpu::{Gpu, kernels::Deformation};
use physvideo_tests::device::gpu;

use physvideo_tests::problems::setup::{Lattice, solver, world};

const DX: f64 = 1.0 / 16.0;
/// Half a cell of motion a substep.
const SPEED: f32 = 2.0;
const DT: f32 = 1.0 / 64.0;

/// A stream through a box of four cells along z: from [0, 0.25) up to z = 0.5, where it starts anew.
fn stream(material: Material, recycles: bool) -> World {
    let cube = Lattice::of_eight(DX).fill([0.0; 3], [0.25; 3], |_| true);
    let returns = Return {
        region: 1,
        solid: 1.0,
        stream: 5,
        region_min: [-9.0, -9.0, 0.5, 0.0],
        region_max: [9.0, 9.0, 9.0, 0.0],
        source_min: [0.0; 4],
        source_max: [0.25, 0.25, 0.25, 0.0],
        velocity: [0.0, 0.0, SPEED, 0.0],
        ..Default::default()
    };
    let moving = Lattice::of_eight(DX).body(material, 15.0, &cube, |_| [0.0, 0.0, SPEED.into()]);
    let moving = Body { recycle: recycles.then_some(returns), ..moving };
    let mut w = world(vec![moving], DX, [-0.1, -0.1, -0.1], [0.35, 0.35, 0.6]);
    w.force_dt = Some(DT);
    w
}

/// Plays `frames` of 64 substeps: returns of each frame, and what is left at the end.
fn play(gpu: &Gpu, w: &World, frames: usize) -> (Vec<u32>, Vec<Particle>, Vec<Deformation>) {
    let mut mpm = solver(gpu, w, "updated_lagrangian").unwrap();
    let counts = (0..frames).map(|_| mpm.frame(1.0).unwrap().recycled).collect();
    (counts, gpu.read(mpm.particles()).unwrap(), gpu.read(mpm.deformations()).unwrap())
}

/// All move at v through a mean distance of 0.375 m, and are seen at the end of the substep in which they arrive, half a
/// substep late on average: N/(0.375/v + dt/2) returns a second.
#[test]
fn a_hundred_thousand_returns_keep_their_rate() {
    let gpu = gpu();
    // So soft that a step of half a cell is below its limit.
    let snow = Material::Snow {
        young: 1.0,
        poisson: 0.1,
        critical_compression: 0.025,
        critical_stretch: 0.0075,
        hardening: 10.0,
    };
    let w = stream(snow, true);
    let n = w.bodies[0].positions.len() as f64;
    let (counts, particles, deformations) = play(&gpu, &w, 42);
    let all: u32 = counts.iter().sum();
    let rate = n / (0.375 / f64::from(SPEED) + 0.5 * f64::from(DT));
    // The first frame starts with a full source, not with a full stream.
    let steady = f64::from(all - counts[0]) / 41.0;
    assert!(all > 100_000, "{all} returns");
    // Places are random: √(returns/12)/returns is 1e-3.
    assert!((steady / rate - 1.0).abs() < 5e-3, "{steady} returns a second for {rate}");
    // No drift: the last tenth is as the first (each frame's count scatters by a hundredth).
    let of = |range: std::ops::Range<usize>| counts[range].iter().sum::<u32>() as f64;
    assert!((of(38..42) / of(1..5) - 1.0).abs() < 2e-2, "{counts:?}");
    for (p, d) in particles.iter().zip(&deformations) {
        assert_eq!(p.tag & QUARANTINED, 0);
        assert!(p.x.iter().chain(&p.v).chain(&d.f0).all(|c| c.is_finite()));
        assert!((0.0..=0.25).contains(&p.x[0]) && (0.0..0.6).contains(&p.x[2]), "{:?}", p.x);
        assert!((p.v[2] - SPEED).abs() < 1e-3 && p.v[0].abs() < 1e-3, "{:?}", p.v);
    }
    let (again, same, _) = play(&gpu, &w, 2);
    assert_eq!(again, counts[..2]);
    assert_eq!(same, play(&gpu, &w, 2).1);
    // Control: without returns they leave the grid and are taken out.
    let mut lost = solver(&gpu, &stream(snow, false), "updated_lagrangian").unwrap();
    let stats = lost.frame(1.0).unwrap();
    assert_eq!((f64::from(stats.quarantined), stats.left, stats.rejected), (n, stats.quarantined, 0));
}

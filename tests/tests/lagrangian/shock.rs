//! Impacts beyond the speed of waves: shocks take energy, nothing makes any, and nobody passes through anybody.

use physvideo::scene::Material;
use physvideo::world::{Body, World, ground};
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::{device, folder};

use super::setup::{body, center, fill, particles, solver, world};

const DX: f64 = 1.0 / 16.0;
const SIDE: f64 = 4.0 * DX;
const YOUNG: f64 = 8e4;
const POISSON: f64 = 0.32;
/// sqrt((λ + 2μ)/ρ) at 1000 kg/m³ [m/s].
const WAVES: f64 = 10.7;

fn block(low: f64, v: f64, neo: bool) -> Body {
    let cube = fill(DX, [0.0, 0.0, low], [SIDE, SIDE, SIDE + low], |_| true);
    let mut b = body((YOUNG, POISSON), 1000.0, DX, cube, |_| [0.0, 0.0, v as f32]);
    if neo {
        b.material = Material::NeoHookean { young: YOUNG as f32, poisson: POISSON as f32 };
    }
    b
}

/// What a run of 60 frames, in which the first body would go its own height and a half, shows.
struct Seen {
    /// Largest energy, and that at the end, over that at the start.
    most: f64,
    end: f64,
    /// Lowest particle [m].
    lowest: f64,
    /// Heights of the bodies at the end [m].
    heights: Vec<f64>,
}

fn play(gpu: &Gpu, w: &World, speed: f64) -> Seen {
    let mut s = solver(gpu, w);
    let energy = |s: &physvideo::stages::lagrangian::Lagrangian| -> f64 {
        let all = (0..w.bodies.len()).map(|i| s.measure(i).unwrap());
        all.map(|m| m.kinetic + m.elastic - f64::from(w.gravity[2]) * m.height).sum()
    };
    let start = energy(&s);
    let mut seen = Seen { most: 0.0, end: 0.0, lowest: f64::MAX, heights: vec![] };
    for _ in 0..60 {
        s.frame((1.5 * SIDE / speed / 10.0) as f32).unwrap();
        seen.end = energy(&s) / start;
        seen.most = seen.most.max(seen.end);
        let all = particles(gpu, &s);
        seen.lowest = all.iter().map(|p| f64::from(p.x[2])).fold(seen.lowest, f64::min);
        let each = w.bodies[0].positions.len();
        seen.heights = (0..w.bodies.len()).map(|b| center(&all, |i| i / each == b)[2]).collect();
    }
    gpu.free_arena("run");
    seen
}

fn falls(speed: f64, neo: bool) -> World {
    let mut w = world(vec![block(0.005, -speed, neo)], DX);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.3)];
    w
}

#[test]
fn an_impact_makes_no_energy_and_stays_above_the_ground() {
    let gpu = device::gpu();
    for (speed, neo) in [(40.0, false), (40.0, true), (100.0, false)] {
        let seen = play(&gpu, &falls(speed, neo), speed);
        println!(
            "{:.1} times the waves: energy {:.3} at most, {:.3} at the end, lowest {:.3} m",
            speed / WAVES,
            seen.most,
            seen.end,
            seen.lowest
        );
        // Springs of contact give way by some cells' tenths for each doubling of the speed.
        assert!(seen.most < 1.01 && seen.end < 0.6 && seen.lowest > -1.75 * DX, "{speed} m/s, neo-Hookean: {neo}");
        assert!(seen.heights[0] > 0.125, "it bounces: {:?}", seen.heights);
    }
    assert_eq!(gpu.messages(), Vec::<String>::new());
}

/// Control: without the pressure of the shock in cells and in contact the same impact makes energy, or sinks in.
#[test]
fn without_a_shock_it_does() {
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), "lib/shock", "const SHOCK: f32 = 1.5;", "const SHOCK: f32 = 0.0;");
    folder::edit(copy.path(), "lib/squash", "const SQUASHED_STIFF: f32 = 12.0;", "const SQUASHED_STIFF: f32 = 0.0;");
    let gpu = device::open(Options { wgsl: Some(copy.path().into()), ..device::options() });
    let seen = play(&gpu, &falls(40.0, false), 40.0);
    println!("without: energy {:.3} at most, lowest {:.3} m", seen.most, seen.lowest);
    assert!(seen.most > 1.05 || seen.lowest < -1.5 * DX, "{} of the energy, {} m", seen.most, seen.lowest);
}

/// A slow impact feels nothing of it: half of a quarter of the waves' speed leaves the energy to the springs.
#[test]
fn a_slow_impact_keeps_its_energy() {
    let gpu = device::gpu();
    let speed = 0.12 * WAVES;
    let mut w = falls(speed, false);
    w.gravity = [0.0; 3];
    let seen = play(&gpu, &w, speed);
    println!("slow: energy {:.3} at most, {:.3} at the end", seen.most, seen.end);
    // Verlet's energy swings by some percent where steps are coarse.
    assert!((seen.end - 1.0).abs() < 0.06 && seen.most < 1.1, "{} and {}", seen.most, seen.end);
}

#[test]
fn bodies_that_meet_faster_than_their_waves_do_not_pass() {
    let gpu = device::gpu();
    for (times, neo) in [(2.0, false), (3.7, false), (3.7, true)] {
        let speed = times * WAVES;
        let w = world(vec![block(0.005, -0.5 * speed, neo), block(-0.005 - SIDE, 0.5 * speed, neo)], DX);
        let seen = play(&gpu, &w, speed);
        println!(
            "{times} times the waves: energy {:.3} at most, {:.3} at the end, at {:.3?} m",
            seen.most, seen.end, seen.heights
        );
        assert!(seen.most < 1.01 && seen.end < 0.8, "{times}: {} and {}", seen.most, seen.end);
        assert!(seen.heights[0] > 0.125 && seen.heights[1] < -0.125, "{times}: {:?}", seen.heights);
    }
}

//! Parts one and two particles thick bend with the stiffness of their thickness and do not fold: a strip clamped at one
//! end sags by w L⁴/(8 E I), I = h³/12 a width, where the load is so small that it stays nearly straight. With one
//! point a particle one layer sank 27 times as far, and two layers 1.33 times: n layers of points have 1 − 1/n² of I.

use physvideo::stages::solver::Solver;
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::device::{self, gpu};
use physvideo_tests::folder;

use super::cantilever::sag;
use super::setup::{body, fill, solver, world};

/// How far off the sag may be: the layers that are told apart are 33 % off or more.
const CLOSE: f64 = 0.02;

/// Sag of a strip over that of a beam of its thickness, shear included (0.8 (h/L)², see `cantilever`).
fn against_beam(layers: f64, slender: f64, heavier: f64) -> f64 {
    // 0.12347 at a load of 1, linear to a percent at 0.2.
    let load = 0.2;
    sag(heavier * load, 0.5 * layers, slender) / (load / 8.0 * (1.0 + 0.8 / slender.powi(2)))
}

#[test]
fn one_layer_bends_as_its_thickness_says() {
    let ratio = against_beam(1.0, 16.0, 1.0);
    println!("one layer: {ratio:.4} of the beam's sag");
    assert!((ratio - 1.0).abs() < CLOSE, "{ratio}");
}

#[test]
fn two_layers_bend_as_their_thickness_says() {
    let ratio = against_beam(2.0, 10.0, 1.0);
    println!("two layers: {ratio:.4} of the beam's sag");
    assert!((ratio - 1.0).abs() < CLOSE, "{ratio}");
}

/// Control: a strip under a twentieth more weight than it is compared by is told apart.
#[test]
fn a_heavier_strip_is_told_apart() {
    let ratio = against_beam(1.0, 16.0, 1.05);
    assert!(ratio - 1.0 > CLOSE, "{ratio}");
}

/// A strip of so many layers, clamped at one end, that is thrown into its first bending: two periods of swinging by a
/// quarter of its length. Least and most of its energy over that at the start, and how often a frame seemed to gain some.
fn swing(gpu: &Gpu, layers: f64) -> (f64, f64, u32) {
    let (dx, young) = (1.0, 1e4);
    let (thick, length) = (0.5 * layers * dx, 8.0 * layers * dx);
    // ω = 3.516/L² √(E h²/12 ρ)
    let omega = 3.516 / length.powi(2) * (young / 12.0f64).sqrt() * thick;
    let strip = fill(dx, [-2.0 * dx, 0.0, 0.0], [length, dx, thick], |_| true);
    // The shape of a beam that sags, nearly that of its first vibration.
    let shape = |s: f64| s * s * (6.0 - 4.0 * s + s * s) / 3.0;
    let speed = |x: [f32; 3]| [0.0, 0.0, (0.25 * length * omega * shape((f64::from(x[0]) / length).max(0.0))) as f32];
    let mut b = body((young, 0.0), 1.0, dx, strip, speed);
    b.pinned = b.positions.iter().map(|x| x[0] < 0.0).collect();
    let mut w = world(vec![b], dx);
    w.courant = 0.2;
    let mut s = solver(gpu, &w);
    let energy = |s: &dyn Solver| s.measure(0).map(|m| m.kinetic + m.elastic).unwrap();
    let start = energy(&s);
    let mut range = (1.0f64, 1.0f64, 0);
    for _ in 0..24 {
        let stats = s.frame((std::f64::consts::TAU / omega / 12.0) as f32).unwrap();
        let share = energy(&s) / start;
        range = (range.0.min(share), range.1.max(share), range.2 + stats.gained);
    }
    drop(s);
    gpu.free_arena("run");
    range
}

/// What bends and swings keeps its energy. Verlet's swings by (ω dt/2)² for the high vibrations that the throw wakes too: by
/// 0.6 % at Courant number 0.75, by 0.03 % at 0.2.
#[test]
fn energy_of_bending_is_counted() {
    let gpu = gpu();
    for layers in [1.0, 2.0] {
        let (least, most, gained) = swing(&gpu, layers);
        println!("{layers} layers: {least:.4} to {most:.4} of the energy");
        assert!(least > 0.999 && most < 1.001 && gained == 0, "{layers} layers: {least}, {most}");
    }
    // Control: particles alone tell nothing of one layer's bending, and three quarters of that of two.
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), "lagrangian/bend", ".volume * sum", ".volume * 0.0");
    let blind = device::open(Options { wgsl: Some(copy.path().into()), ..device::options() });
    for (layers, told) in [(1.0, 0.1), (2.0, 0.85)] {
        let (least, _, gained) = swing(&blind, layers);
        println!("{layers} layers, particles alone: {least:.4}, {gained} gains");
        // What comes back from bending seems gained, where that is more than a fifth.
        assert!(least < told && (gained > 0 || layers > 1.0), "{layers} layers: {least}, {gained} gains");
    }
}

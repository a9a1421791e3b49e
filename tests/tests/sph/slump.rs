//! A column of thick liquid that slips on its floor sinks by its own weight: gravity, pressure and viscosity in balance.

use std::f64::consts::PI;

use physvideo::scene::{Pressure, Viscosity};
use physvideo::stages::sph::Sph;
use physvideo::world::ground;
use physvideo_tests::device::gpu;
use physvideo_tests::liquid::{lattice, liquid, world};

const H: f64 = 0.013;
/// Height and width of the column [m].
const SIDE: f64 = 8.0 * H;
/// [s]
const TIME: f64 = 0.1;

/// How far the centre of mass sinks in [`TIME`] [m], and the steps that takes.
fn sunk(viscosity: f32) -> (f64, u32) {
    let body = liquid(1000.0, viscosity, H, lattice(H, [0.0; 3], [SIDE; 3]));
    let mut w = world(Pressure::Dfsph, H, vec![body], [-0.2, -0.2, -0.1], [0.3; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.0)];
    w.fluid.viscosity = Viscosity::Implicit;
    let gpu = gpu();
    let mut sph = Sph::new(&gpu, &w).unwrap();
    let before = sph.measure(0).unwrap();
    let stats: Vec<_> = (0..2).map(|_| sph.frame(0.5 * TIME as f32).unwrap()).collect();
    assert!(stats.iter().all(|s| s.rejected + s.unsolved + s.quarantined == 0), "{stats:?}");
    let after = sph.measure(0).unwrap();
    ((before.height - after.height) / before.mass, stats.iter().map(|s| s.substeps).sum())
}

/// How far its centre of mass sinks, of what is wide and slips everywhere: each slice carries what is above it by three
/// times the viscosity (Trouton) on an area that grows as it gets thinner, so that a slice with u of the height above it at
/// the start is 1 + a u times as thin at a = g t/(3 ν). It gets there late by the time that shear takes through the column.
fn sinks(viscosity: f64) -> f64 {
    let late = 4.0 * SIDE * SIDE / (3.0 * PI * PI * viscosity);
    let a = 9.81 * (TIME - late) / (3.0 * viscosity);
    0.5 * SIDE - (1.0 / a - (a * SIDE).ln_1p() / (a * a * SIDE))
}

#[test]
fn a_thick_column_sinks_at_its_own_pace() {
    let (sunk_by, steps) = sunk(0.2);
    let off = sunk_by / sinks(0.2) - 1.0;
    // Eight layers, and steps of 2 ms, a third of the time it takes to begin.
    assert!(off.abs() < 0.05, "sinks by {sunk_by:.5} m, {off:+.3} off");
    let thicker = sunk(0.5).0 / sinks(0.5) - 1.0;
    assert!(thicker.abs() < 0.1, "{thicker:+.3} off at 0.5 m²/s");
    // Explicit viscosity would take a thousand.
    assert!(steps < 200, "{steps} steps");
    // Control: half as much viscosity again is told apart.
    let ratio = sunk(0.3).0 / sunk_by;
    assert!(ratio < 0.85, "with 1.5 times the viscosity it sinks {ratio:.3} times as far");
}

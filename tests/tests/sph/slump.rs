//! A column of thick liquid that slips on its floor sinks by its own weight: gravity, pressure and viscosity in balance.

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

#[test]
fn a_thick_column_sinks_at_its_own_pace() {
    // Each slice carries what is above it by three times the viscosity (Trouton): the mean of ∫ g (H − z)/(3 ν) dz.
    let pace = |viscosity: f64| 9.81 * SIDE * SIDE / (9.0 * viscosity);
    let (sunk_by, steps) = sunk(0.2);
    let off = sunk_by / (pace(0.2) * TIME) - 1.0;
    // It is slower at the start, for a seventh of the time; and steps of 2 ms and eight layers make it faster.
    assert!(off.abs() < 0.15, "sinks by {sunk_by:.5} m, {off:+.3} off");
    // Explicit viscosity would take a thousand.
    assert!(steps < 200, "{steps} steps");
    // Control: half as much viscosity again is told apart.
    let ratio = sunk(0.3).0 / sunk_by;
    assert!(ratio < 0.85, "with 1.5 times the viscosity it sinks {ratio:.3} times as far");
}

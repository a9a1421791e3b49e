//! Liquid of the grid: a column collapses in a closed room, sloshes and keeps its volume, and none of it leaves.

use physvideo::scene::{Material, Shape};
use physvideo::world;
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::device::{self, gpu};
use physvideo_tests::folder;

use physvideo_tests::problems::setup::{Lattice, solver, world as empty};

const DX: f64 = 0.02;
/// The room's half extents [m]: 0.36 × 0.12 m of floor.
const HALF: [f64; 3] = [0.18, 0.06, 0.4];

/// Height of the centre of mass [m] and the largest distance outside of the room [cells] after 3 s of a column of
/// 0.12 × 0.12 × 0.24 m, with an elastic block of some density [kg/m³] and 2 cells in its way or without.
fn settle(gpu: &Gpu, block: Option<f64>) -> (f64, f64) {
    let column = Lattice::of_eight(DX).fill([0.0; 3], [0.12, 0.12, 0.24], |_| true);
    let water = Material::Liquid { bulk: 2e5, exponent: 7.0, viscosity: 0.0 };
    let mut w =
        empty(vec![Lattice::of_eight(DX).body(water, 1000.0, &column, |_| [0.0; 3])], DX, [-0.1; 3], [0.46, 0.22, 0.9]);
    if let Some(density) = block {
        let cube = Lattice::of_eight(DX).fill([0.26, 0.04, 0.0], [0.3, 0.08, 0.04], |_| true);
        let soft = Material::Elastic { young: 1e5, poisson: 0.3 };
        w.bodies.push(Lattice::of_eight(DX).body(soft, density, &cube, |_| [0.0; 3]));
    }
    w.gravity = [0.0, 0.0, -9.81];
    let half = HALF.map(|h| h as f32);
    let shape = Shape::Room { center: half, half };
    w.colliders = vec![world::collider(&physvideo::scene::Collider {
        shape,
        friction: 0.0,
        sticky: false,
        velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
        start: 0.0,
        end: 1e9,
    })];
    let mut mpm = solver(gpu, &w, "updated_lagrangian").unwrap();
    let mut outside = 0.0f64;
    for _ in 0..30 {
        let stats = mpm.frame(0.1).unwrap();
        assert_eq!(stats.quarantined, 0, "{stats:?}");
        for p in gpu.read_range(mpm.particles(), 0, column.len() as u64).unwrap() {
            for (x, half) in p.x.iter().zip(HALF) {
                outside = outside.max(((f64::from(*x) - half).abs() - half) / DX);
            }
        }
    }
    let m = mpm.measure(0).unwrap();
    (m.height / m.mass, outside)
}

/// Three times the floor: 0.08 m deep, its centre of mass at 0.04 m.
#[test]
fn a_column_of_liquid_settles_at_its_depth() {
    let (height, outside) = settle(&gpu(), None);
    println!("liquid: centre of mass at {height:.4} m of 0.04, at most {outside:.2} cells outside");
    // It still sloshes a little, and rests up to 0.3 cells below the floor: 6 mm of 40.
    assert!((height - 0.04).abs() < 0.006, "{height} m");
    assert!(outside < 0.5, "{outside} cells outside of the room");
}

/// Control: with J from the divergence alone a third of the volume is lost, beside another density as well.
#[test]
fn a_liquid_that_forgets_its_density_is_told_apart() {
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    folder::edit(copy.path(), "mpm/g2p", "FOLLOW: f32 = 0.1", "FOLLOW: f32 = 0.0");
    for block in [None, Some(4000.0), Some(250.0)] {
        let (height, _) = settle(&device::open(Options { wgsl: Some(copy.path().into()), ..device::options() }), block);
        assert!(height < 0.034, "{height} m beside {block:?} kg/m³");
    }
}

/// Beside a block four times or a quarter as dense it settles as deep as alone, to the same 6 mm; the block itself raises it
/// by less than one.
#[test]
fn a_liquid_beside_another_density_keeps_its_volume() {
    for density in [4000.0, 250.0] {
        let (height, outside) = settle(&gpu(), Some(density));
        println!("beside {density} kg/m³: centre of mass at {height:.4} m of 0.04, at most {outside:.2} cells outside");
        assert!((height - 0.04).abs() < 0.006 && outside < 0.5, "beside {density} kg/m³: {height} m, {outside} cells");
    }
}

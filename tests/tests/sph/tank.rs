//! S1: water at rest in a tank. Pressure grows with depth, density stays.

use physvideo::assemble::{Inputs, assemble};
use physvideo::fluid::Fluid;
use physvideo::plan::Plan;
use physvideo::scene::{Pressure, Until, parse};
use physvideo::stages::sph::Sph;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::sph::{Tank, tank};

/// Error of the pressure at the base and largest excess of density, when the answer is asked for another density or gravity.
fn error(pressure: Pressure, change: impl Fn(&mut Tank)) -> (f64, f64) {
    let mut t = Tank { fluid: Fluid { pressure, ..Default::default() }, ..Default::default() };
    change(&mut t);
    let r = tank(&gpu(), &t).unwrap();
    (r.base, r.densest)
}

#[test]
fn pressure_at_the_base_carries_the_water() {
    let (base, _) = error(Pressure::Wcsph, |_| ());
    assert!(base < 5e-3, "WCSPH: {base:.1e}");
    let (base, densest) = error(Pressure::Dfsph, |_| ());
    assert!(base < 1e-2, "DFSPH: {base:.1e}");
    // A solve ends at a mean of 1e-4; the densest particle may have some times that.
    assert!(densest < 1e-3, "DFSPH: s exceeds 1 by {densest:.1e}");
    // Controls: another density than the answer's, and solves that end whatever is left.
    assert!(error(Pressure::Wcsph, |t| t.density = 900.0).0 > 0.05, "900 kg/m³ passes for 1000");
    let loose = |t: &mut Tank| (t.fluid.density_error, t.fluid.divergence_error) = (1.0, 1.0);
    assert!(error(Pressure::Dfsph, loose).1 > 2.0 * densest, "two iterations do as well");
}

/// A ball and a mesh that fill a room of their size stand in whole layers too, and a box on a slope starts without what would
/// be too near to it: they fall, and nothing throws them off their walls (8 m/s, or no end of a frame, on a lattice that comes to
/// a tenth of a particle).
#[test]
fn what_is_round_or_stands_on_a_slope_keeps_clear_of_walls() {
    let gpu = gpu();
    let slope = "[[collider]]\nshape.plane = { point = [0, 0, -0.009], normal = [0.3, 0, 1] }";
    let file = "source.mesh = { file = 'cube.obj', scale = 0.198, position = [0, 0, 0.099] }";
    let corner = |i: u32| [0, 1, 2].map(|a| if i >> a & 1 == 1 { 0.5f32 } else { -0.5 });
    // Two triangles a side, faces outwards.
    let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    let cube = ((0..8).map(corner).collect::<Vec<_>>(), triangles);
    for (source, more) in [
        ("source.ball = { center = [0, 0, 0.099], radius = 0.099 }", ""),
        (file, ""),
        ("source.box = { min = [-0.06, -0.06, 0], max = [0.06, 0.06, 0.1] }", slope),
    ] {
        for pressure in ["wcsph", "dfsph"] {
            let text = format!(
                "simulation.pressure = '{pressure}'
                 {more}
                 [[collider]]
                 shape.room = {{ center = [0, 0, 0.15], half = [0.099, 0.099, 0.15] }}
                 [[object]]
                 name = 'water'
                 {source}
                 material.sph = {{}}
                 density = 1000.0"
            );
            let scene = parse(&text, "room.toml").unwrap();
            let inputs = Inputs { meshes: [(0, cube.clone())].into(), ..Default::default() };
            let assembled = assemble(&scene, &inputs, &Plan::new(&scene, Until::State)).unwrap();
            let told = assembled.notes.iter().any(|n| n.contains("are left out"));
            assert_eq!(told, more == slope, "{source}: {:?}", assembled.notes);
            let world = assembled.world;
            let mut sph = Sph::new(&gpu, &world).unwrap();
            let begun = sph.measure(0).unwrap();
            for _ in 0..3 {
                let stats = sph.frame(0.04).unwrap();
                assert_eq!((stats.gained, stats.rejected), (0, 0), "{source} {pressure}: {stats:?}");
                let m = sph.measure(0).unwrap();
                // A fall of its height makes 2 m/s, and corners gather it.
                assert!(m.speed < 4.0, "{source} {pressure}: {} m/s", m.speed);
                assert!(m.kinetic + m.potential < 1.02 * begun.potential, "{source} {pressure}: {begun:?} {m:?}");
            }
        }
    }
}

/// A room on the ground has one floor: the liquid in it moves as without the ground, bit for bit. Control: a ground above the
/// room's floor carries it higher.
#[test]
fn a_room_on_the_ground_has_one_floor() {
    let gpu = gpu();
    for pressure in ["wcsph", "dfsph"] {
        let end = |ground: &str, low: f32| {
            let text = format!(
                "simulation.pressure = '{pressure}'
                 {ground}
                 [[collider]]
                 shape.room = {{ center = [0, 0, 0.1], half = [0.13, 0.1, 0.1] }}
                 [[object]]
                 name = 'water'
                 source.box = {{ min = [-0.13, -0.1, {low}], max = [0, 0.1, 0.15] }}
                 material.sph = {{}}
                 density = 1000.0"
            );
            let scene = parse(&text, "room.toml").unwrap();
            let world = assemble(&scene, &Inputs::default(), &Plan::new(&scene, Until::State)).unwrap().world;
            let mut sph = Sph::new(&gpu, &world).unwrap();
            for _ in 0..3 {
                let stats = sph.frame(0.04).unwrap();
                assert_eq!((stats.gained, stats.rejected), (0, 0), "{pressure}: {stats:?}");
            }
            sph.measure(0).unwrap()
        };
        let (alone, both) = (end("", 0.0), end("ground.height = 0.0", 0.0));
        assert_eq!(alone, both, "{pressure}");
        assert_ne!(end("ground.height = 0.02", 0.02), both, "{pressure}");
    }
}

/// A box of liquid whose sides are no whole number of particles fills a room of its size: it stands in the middle, no
/// nearer to a wall than half a particle to its image, and lies still.
#[test]
fn a_box_that_fits_no_lattice_stays_in_its_room() {
    let gpu = gpu();
    for pressure in ["wcsph", "dfsph"] {
        let text = format!(
            "[simulation]
             pressure = '{pressure}'
             [[collider]]
             shape.room = {{ center = [0, 0, 0.1], half = [0.1, 0.1, 0.1] }}
             [[object]]
             name = 'water'
             source.box = {{ min = [-0.1, -0.1, 0], max = [0.1, 0.1, 0.1] }}
             material.sph = {{}}
             density = 1000.0"
        );
        let scene = parse(&text, "room.toml").unwrap();
        let world = assemble(&scene, &Inputs::default(), &Plan::new(&scene, Until::State)).unwrap().world;
        let nearest = |x: &[f32; 3]| (0.1 - x[0].abs()).min(0.1 - x[1].abs()).min(x[2]);
        let gap = world.bodies[0].positions.iter().map(nearest).fold(f32::MAX, f32::min);
        assert!(gap > 0.499 * 0.013, "{gap} m from a wall");
        let mut sph = Sph::new(&gpu, &world).unwrap();
        let begun = sph.measure(0).unwrap();
        for _ in 0..3 {
            let stats = sph.frame(0.04).unwrap();
            assert_eq!((stats.gained, stats.rejected, stats.quarantined), (0, 0, 0), "{pressure}: {stats:?}");
        }
        let after = sph.measure(0).unwrap();
        assert!(after.kinetic + after.potential < 1.02 * begun.potential, "{pressure}: {begun:?} {after:?}");
    }
}

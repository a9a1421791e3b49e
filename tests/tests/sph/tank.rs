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

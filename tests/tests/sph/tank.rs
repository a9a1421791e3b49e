//! S1: water at rest in a tank. Pressure grows with depth, density stays.

use physvideo::fluid::Fluid;
use physvideo::scene::Pressure;
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

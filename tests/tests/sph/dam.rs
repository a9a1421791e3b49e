//! S2: a dam breaks. The front of a column of water against the band of Martin & Moyce's experiments.

use physvideo::scene::Pressure;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::sph::{Dam, dam, off_the_band};

#[test]
fn the_front_runs_with_the_band() {
    let off = |d: Dam| off_the_band(&dam(&gpu(), &d).unwrap().0).0;
    for pressure in [Pressure::Wcsph, Pressure::Dfsph] {
        // The goal of the suite.
        let water = Dam { across: 8, pressure, ..Default::default() };
        let rubbed = off(water);
        assert!(rubbed < 0.05, "{pressure:?}: {rubbed:.3} outside the band");
        // Controls: on a floor that does not rub the front is early, at half the gravity it is late.
        let smooth = off(Dam { friction: 0.0, ..water });
        assert!(smooth > 1.5 * rubbed, "{pressure:?}: {smooth:.3} without friction, {rubbed:.3} with it");
        assert!(off(Dam { gravity: 4.9, ..water }) > 0.12, "{pressure:?}: the band holds whatever the gravity");
    }
}

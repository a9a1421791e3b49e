//! S2: a dam breaks. The front of a column of water against the band of Martin & Moyce's experiments.

use physvideo::scene::Pressure;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::sph::{dam, off_the_band};

#[test]
fn the_front_runs_with_the_band() {
    let off = |pressure, gravity| off_the_band(&dam(&gpu(), 6, pressure, 0.75, gravity).unwrap().0).0;
    // The goal of the suite; six particles across, no friction: some percent ahead of water on a real floor.
    let solved = off(Pressure::Dfsph, 9.81);
    assert!(solved < 0.05, "DFSPH: {solved:.3} outside the band");
    // Control: at half the gravity the front is late.
    assert!(off(Pressure::Dfsph, 4.9) > 0.12, "the band holds whatever the gravity");
}

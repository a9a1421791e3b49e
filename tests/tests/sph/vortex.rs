//! S3: a Taylor–Green vortex.

use physvideo::scene::Pressure;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::viscous::{decayed, off_the_decay, vortex};

/// Particles that leave their lattice take speed from the vortex: it goes on turning, and that is all that is asked here.
/// Viscosity alone is right within some percent (`twist`).
#[test]
fn a_vortex_slows_down_by_more_than_its_viscosity() {
    let flow = vortex(&gpu(), 20, Pressure::Dfsph, 0.75).unwrap();
    assert!(flow.frames.iter().all(|f| f.clamped_velocity + f.quarantined + f.rejected == 0), "{:?}", flow.frames);
    let (error, last) = (off_the_decay(&flow.speeds), flow.speeds[4]);
    assert!(error < 0.5, "{error:.3}: {:.4?}", flow.speeds);
    assert!(last < decayed(1.0) && flow.speeds.is_sorted_by(|a, b| a > b), "it gains speed: {:.4?}", flow.speeds);
}

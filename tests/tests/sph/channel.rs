//! S4: a channel from rest. The speed in its middle grows as the series of Poiseuille's flow says.

use physvideo::scene::Pressure;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::sph::{TIMES, channel, off_the_series, poiseuille};

#[test]
fn a_channel_speeds_up_as_the_series_says() {
    let n = 6;
    let (speeds, run) = channel(&gpu(), n, Pressure::Wcsph, 0.75, true).unwrap();
    assert!(run.frames.iter().all(|f| f.clamped_velocity == 0));
    let error = off_the_series(&speeds, n);
    // Images of the velocity behind the plates are of second order: (h/L)² = 2.8 % of u_max at six particles.
    assert!(error < 0.045, "{error:.3}: {speeds:.4?}");
    // Controls: another viscosity is told apart, and so are plates that let slip.
    let other = TIMES.iter().zip(&speeds).map(|(t, u)| (u - poiseuille(1.3 * t)).abs()).fold(0.0, f64::max);
    assert!(other > 0.07, "1.3 ν passes for ν: {other:.3}");
    let (slipping, _) = channel(&gpu(), n, Pressure::Wcsph, 0.75, false).unwrap();
    assert!(off_the_series(&slipping, n) > 1.0, "nothing holds the water at plates that let slip");
}

//! S4: a channel from rest. The speed in its middle grows as the series of Poiseuille's flow says.

use physvideo::scene::Pressure;
use physvideo_tests::device::gpu;
use physvideo_tests::problems::viscous::{TIMES, channel, off_the_series, poiseuille};

#[test]
fn a_channel_speeds_up_as_the_series_says() {
    let n = 6;
    let flow = channel(&gpu(), n, Pressure::Wcsph, 0.75, true).unwrap();
    assert!(flow.frames.iter().all(|f| f.clamped_velocity == 0));
    let error = off_the_series(&flow.speeds, n);
    // Images of the velocity behind the plates are of second order: (h/L)² = 2.8 % of u_max at six particles.
    assert!(error < 0.031, "{error:.4}: {:.4?}", flow.speeds);
    // Controls: another viscosity is told apart, and so are plates that let slip.
    let off = |(t, u): (&f64, &f64)| (u - poiseuille(0.5 + 0.5 / f64::from(n), 1.3 * t)).abs();
    let other = TIMES.iter().zip(&flow.speeds).map(off).fold(0.0, f64::max);
    assert!(other > 0.06, "1.3 ν passes for ν: {other:.3}");
    let slipping = channel(&gpu(), n, Pressure::Wcsph, 0.75, false).unwrap();
    assert!(off_the_series(&slipping.speeds, n) > 1.0, "nothing holds the water at plates that let slip");
}

//! M5: a vibrating bar.

use physvideo_tests::device::gpu;
use physvideo_tests::problems::bar::{PERIOD, vibrate};

use super::{at, order};

#[test]
fn a_bar_vibrates_at_its_frequency() {
    let gpu = gpu();
    let v = vibrate(&gpu, at(50, 0.75), 100.0).unwrap();
    println!("bar: period {:.4} s of 10, amplitude loss {:.2} % a period", v.period, 100.0 * v.loss);
    // Goals: 0.1 % and 1 %.
    assert!((v.period / PERIOD - 1.0).abs() < 1e-3 && v.loss.abs() < 1e-2 && v.outcome.clamps == 0, "{v:?}");
    // Control: 1 % more stiffness is half a percent of period, which must show.
    let stiffer = vibrate(&gpu, at(50, 0.75), 101.0).unwrap();
    assert!((stiffer.period / PERIOD - 1.0).abs() > 3e-3 && stiffer.outcome.error > 2.0 * v.outcome.error);
}

#[test]
fn the_motion_converges() {
    let gpu = gpu();
    let errors = [10, 20, 40].map(|n| (f64::from(n), vibrate(&gpu, at(n, 0.75), 100.0).unwrap().outcome.error));
    println!("bar: errors {errors:?}, order {:.2}", order(&errors));
    assert!(order(&errors) > 1.0, "{errors:?}");
}

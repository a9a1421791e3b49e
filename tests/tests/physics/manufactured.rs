//! M2 and M4: motions that a force prescribes.

use physvideo_tests::device::gpu;
use physvideo_tests::problems::manufactured::Motion;

use super::{at, by, order};

#[test]
fn a_bar_follows_its_force() {
    let gpu = gpu();
    let follow = |n, wrong| Motion::bar().follow(&gpu, at(n, 0.75), wrong).unwrap();
    let errors = [8, 16, 32].map(|n| (f64::from(n), follow(n, 1.0).error));
    println!("bar: {errors:?}, order {:.2}", order(&errors));
    // Second order until the quadrature of the steep gradients stops it near half a percent (Steffen 2008): stretch is
    // up to a third here.
    assert!(order(&errors) > 1.8 && errors[2].1 < 1e-2, "{errors:?}");
    // The MLS form, whose sums are over the smoother weights, gets further on smooth motions.
    let mls = Motion::bar().follow(&gpu, by("mls", 32, 0.75), 1.0).unwrap();
    assert!(mls.error < 0.6 * errors[2].1, "{mls:?}");
    // Control: a force for 2 % more stiffness.
    let wrong = follow(32, 1.02).error;
    assert!(wrong > 2.0 * errors[2].1, "{wrong}");
}

#[test]
fn a_cube_follows_its_force() {
    let gpu = gpu();
    let follow = |n, wrong| Motion::cube().follow(&gpu, at(n, 0.75), wrong).unwrap();
    let errors = [8, 12, 16].map(|n| (f64::from(n), follow(n, 1.0).error));
    println!("cube: {errors:?}, order {:.2}", order(&errors));
    // The goal.
    assert!(order(&errors) > 1.8, "{errors:?}");
    // Control: a force for 5 % more stiffness.
    let wrong = follow(12, 1.05).error;
    assert!(wrong > 2.0 * errors[1].1, "{wrong}");
}

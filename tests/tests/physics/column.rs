//! M8: a column at rest.

use physvideo_tests::device::gpu;
use physvideo_tests::problems::column::rest;

use super::{at, order};

#[test]
fn a_column_carries_its_weight() {
    let gpu = gpu();
    let errors = [10, 20, 40].map(|n| {
        let outcome = rest(&gpu, at(n, 0.75), 1800.0).unwrap();
        assert_eq!(outcome.clamps, 0, "{outcome:?}");
        (f64::from(n), outcome.error)
    });
    println!("column: {errors:?}, order {:.2}", order(&errors));
    // The goal, at every particle. The largest error is at the free surface and of first order.
    assert!(errors[2].1 < 5e-3 && order(&errors) > 0.9, "{errors:?}");
    // Control: 2 % more weight.
    let heavier = rest(&gpu, at(40, 0.75), 1836.0).unwrap();
    assert!(heavier.error > 1.5e-2, "{heavier:?}");
}

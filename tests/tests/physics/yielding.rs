//! M10: return maps on single particles, against closed forms.

use physvideo_tests::device::gpu;
use physvideo_tests::problems::yielding::errors;

use super::{at, by};

#[test]
fn return_maps_are_those_of_their_closed_forms() {
    let gpu = gpu();
    for setting in [at(8, 0.4), by("mls", 4, 0.75)] {
        let found = errors(&gpu, setting, 1.0).unwrap();
        println!("return maps: {found:?}");
        // Rounding of stretches, 6e-8 a step, over strains of some percent.
        assert!(found.iter().all(|e| *e < 1e-5), "{found:?}");
    }
    // Control: a yield stress, a friction and a limit that are a thousandth off.
    let off = errors(&gpu, at(8, 0.4), 1.001).unwrap();
    assert!(off.iter().all(|e| *e > 1e-4), "{off:?}");
}

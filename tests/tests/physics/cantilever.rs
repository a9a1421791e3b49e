//! M7 in the form for CI: L/h = 5, four cells thick, load 1.

use physvideo_tests::device::gpu;
use physvideo_tests::problems::cantilever::{Beam, elastica, sag};

use super::{at, by};

/// The table of the literature for the inextensible elastica.
#[test]
fn the_elastica_is_the_elastica() {
    for (load, exact) in [(1.0, 0.123_47), (5.0, 0.495_91), (20.0, 0.829_88)] {
        // Five digits are given.
        assert!((elastica(load) - exact).abs() < 1e-5, "{load}: {} {exact}", elastica(load));
    }
}

#[test]
fn a_beam_sags_as_the_elastica() {
    let gpu = gpu();
    let beam = Beam::new(5.0);
    let exact = beam.exact(1.0);
    let (own, outcome) = sag(&gpu, at(4, 0.75), beam, 1.0).unwrap();
    println!("cantilever: tip {own:.5} of {exact:.5}: {:+.1} %", 100.0 * (own / exact - 1.0));
    // 0.6 % measured; shear and the clamp's place are known to about one.
    assert!((own / exact - 1.0).abs() < 0.02 && outcome.clamps == 0, "tip {own}, exact {exact}, {outcome:?}");
    // Controls: a quarter more load must show; and the MLS gradient sags further than the true one, which is why the
    // true one is the default.
    let (heavier, _) = sag(&gpu, at(4, 0.75), beam, 1.25).unwrap();
    assert!((heavier / exact - 1.0).abs() > 0.12, "tip {heavier}");
    let (mls, _) = sag(&gpu, by("mls", 4, 0.75), beam, 1.0).unwrap();
    println!("cantilever: MLS gradient {mls:.5}");
    assert!(mls > 1.005 * own, "MLS {mls}, true {own}");
}

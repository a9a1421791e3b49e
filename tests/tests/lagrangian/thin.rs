//! Parts one and two particles thick bend with the stiffness of their thickness and do not fold: a strip clamped at one
//! end sags by w L⁴/(8 E I), I = h³/12 a width, where the load is so small that it stays nearly straight. With one
//! point a particle one layer sank 27 times as far, and two layers 1.33 times: n layers of points have 1 − 1/n² of I.

use super::cantilever::sag;

/// How far off the sag may be: the layers that are told apart are 33 % off or more.
const CLOSE: f64 = 0.02;

/// Sag of a strip over that of a beam of its thickness, shear included (0.8 (h/L)², see `cantilever`).
fn against_beam(layers: f64, slender: f64, heavier: f64) -> f64 {
    // 0.12347 at a load of 1, linear to a percent at 0.2.
    let load = 0.2;
    sag(heavier * load, 0.5 * layers, slender) / (load / 8.0 * (1.0 + 0.8 / slender.powi(2)))
}

#[test]
fn one_layer_bends_as_its_thickness_says() {
    let ratio = against_beam(1.0, 16.0, 1.0);
    println!("one layer: {ratio:.4} of the beam's sag");
    assert!((ratio - 1.0).abs() < CLOSE, "{ratio}");
}

#[test]
fn two_layers_bend_as_their_thickness_says() {
    let ratio = against_beam(2.0, 10.0, 1.0);
    println!("two layers: {ratio:.4} of the beam's sag");
    assert!((ratio - 1.0).abs() < CLOSE, "{ratio}");
}

/// Control: a strip under a twentieth more weight than it is compared by is told apart.
#[test]
fn a_heavier_strip_is_told_apart() {
    let ratio = against_beam(1.0, 16.0, 1.05);
    assert!(ratio - 1.0 > CLOSE, "{ratio}");
}

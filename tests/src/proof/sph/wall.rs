//! What walls add to a fluid's sums, in f64: the fluid's mirror image in a plane, summed plane by plane.

use super::{cubic, rub};

/// ∫ V W over a plane at distance z, by quadrature: 2π ∫ W r dr from z to the support's end.
pub fn layer(z: f64) -> f64 {
    integral(z, |r| 2.0 * r * cubic(r).0)
}

/// Its derivative: −2π z W(z).
pub fn layer_slope(z: f64) -> f64 {
    -2.0 * z * cubic(z).0
}

/// Share of the fill, its derivative by distance (in 1/h), and the layers' slopes each times its distance.
pub fn mirrored(d: f64) -> (f64, f64, f64) {
    let z = 2.0 * d.max(0.0);
    let slope = 2.0 * (layer_slope(z) + layer_slope(z + 1.0));
    let inside = if d < 0.0 { -d } else { 0.0 };
    (layer(z) + layer(z + 1.0) + inside, slope, z * layer_slope(z) + (z + 1.0) * layer_slope(z + 1.0))
}

/// What a plane at distance z takes of a velocity (−x, y/2, z/2): ∫ w e·v e_x, e = (z, ρ)/r, by quadrature.
fn layer_squeeze(z: f64) -> f64 {
    let turned = |r: f64| {
        let along = z / r;
        along * r * (along * along - 0.5 * (1.0 - along * along))
    };
    if z > 0.0 { 2.0 * std::f64::consts::PI * integral(z, |r| rub(r) * turned(r) * r) } else { 0.0 }
}

/// Of the mirror image's two layers.
pub fn squeezed(d: f64) -> f64 {
    let z = 2.0 * d.max(0.0);
    layer_squeeze(z) + layer_squeeze(z + 1.0)
}

fn integral(from: f64, f: impl Fn(f64) -> f64) -> f64 {
    // Simpson's rule, exact for these polynomials but for the joint at 1, which is an end of a piece.
    let piece = |a: f64, b: f64| {
        let n = 64;
        let step = (b - a) / f64::from(n);
        (0..n)
            .map(|i| a + step * f64::from(i))
            .map(|x| step / 6.0 * (f(x) + 4.0 * f(x + 0.5 * step) + f(x + step)))
            .sum::<f64>()
    };
    if from >= 2.0 {
        0.0
    } else if from >= 1.0 {
        piece(from, 2.0)
    } else {
        piece(from, 1.0) + piece(1.0, 2.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_one_spacing_apart_fill_space_and_a_mirror_goes_on_with_them() {
        for z in [0.0, 0.3, 0.5, 0.8] {
            let sum: f64 = (-3..=3).map(|k| layer((z + f64::from(k)).abs())).sum();
            assert!((sum - 1.0).abs() < 1e-9, "{z}: {sum}");
        }
        let (share, slope, moment) = mirrored(0.5);
        assert!((share - layer(1.0)).abs() < 1e-9 && (slope + 1.0).abs() < 1e-9 && (moment + 0.5).abs() < 1e-9);
    }
}

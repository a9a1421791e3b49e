// The cubic spline (Monaghan 1992) for particles whose volume at rest is h³: smoothing length h, support 2 h. Lengths
// here are in h, and every weight is multiplied by that volume, so that none has a unit.

// 1/π, but for a part in 4e4: a regular lattice sums to exactly 1.
const SPLINE: f32 = 0.31831850;
// Σ r ∂W/∂r / 3 over a regular lattice: by how much its gradient of a linear field is too steep (1 as h/spacing grows).
const STEEP: f32 = 1.0200978;

// V W(q).
fn spline(q: f32) -> f32 {
    let a = max(2.0 - q, 0.0);
    let b = max(1.0 - q, 0.0);
    return SPLINE * (0.25 * a * a * a - b * b * b);
}

// h V ∂W/∂r (q), not positive.
fn spline_slope(q: f32) -> f32 {
    let a = max(2.0 - q, 0.0);
    let b = max(1.0 - q, 0.0);
    return SPLINE * (3.0 * b * b - 0.75 * a * a);
}

// A plane's share of the kernel's integral: ∫ V W over the plane at distance z, 0 ≤ z. Σ over planes one h apart is 1.
fn layer(z: f32) -> f32 {
    let a = max(2.0 - z, 0.0);
    let b = max(1.0 - z, 0.0);
    let a4 = a * a * a * a;
    let b4 = b * b * b * b;
    return a4 * (0.25 - 0.1 * a) - b4 * (0.5 - 0.4 * b);
}

// What layers of volume behind a plane surface add to a point at distance d (in h) before it. They lie h apart, the
// first h/2 behind the surface, as a regular filling would go on.
fn behind(d: f32) -> f32 {
    let z = abs(d);
    let share = layer(z + 0.5) + layer(z + 1.5);
    return select(1.0 - share, share, d >= 0.0);
}

// Its derivative by d, in 1/h.
fn behind_slope(d: f32) -> f32 {
    let z = abs(d) + 0.5;
    return -6.2831853 * (z * spline(z) + (z + 1.0) * spline(z + 1.0));
}

// Σ of the layers' slopes, each times its distance.
fn behind_moment(d: f32) -> f32 {
    let z = abs(d) + 0.5;
    return -6.2831853 * (z * z * spline(z) + (z + 1.0) * (z + 1.0) * spline(z + 1.0));
}

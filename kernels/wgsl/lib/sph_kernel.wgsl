// The cubic spline (Monaghan 1992) for particles whose volume at rest is h³: smoothing length h, support 2 h. Lengths
// here are in h, and every weight is multiplied by that volume, so that none has a unit.

// 1/π, but for a part in 4e4: a regular lattice sums to exactly 1.
const SPLINE: f32 = 0.31831852;
// Σ r ∂W/∂r / 3 over a regular lattice: by how much its gradient of a linear field is too steep (1 as h/spacing grows).
const STEEP: f32 = 1.0200698;

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

// Viscosity acts between two particles along the line that joins them, so that angular momentum stays (Monaghan 2005;
// Español & Revenga 2003), with a weight of its own. With the spline's slope, Monaghan's, a lattice's shear is 0.70 of
// what is asked for along its axes and 1.45 across its diagonals: Σ r ∂W/∂r x⁴/r⁴ over a lattice is not three times
// Σ r ∂W/∂r x²y²/r⁴, as in a fluid that looks the same in every direction. This weight makes it so, and makes the
// second sum 2, so that Σ (v_j − v_i)·e e rub is h² (∇²v + 2 ∇∇·v) on a lattice; it is 0.3 % less in disorder.
const ROUND: f32 = 0.64529452;
fn rub(q: f32) -> f32 {
    let a = max(2.0 - q, 0.0);
    return 0.81549072 * a * (1.0 + ROUND * a);
}
// Where a lattice ends, a layer that is missing takes so many times as much of that sum as of s.
const SHEARED: f32 = 1.1414433;

// h² V ∂²W/∂r² (q).
fn spline_bend(q: f32) -> f32 {
    return SPLINE * (1.5 * max(2.0 - q, 0.0) - 6.0 * max(1.0 - q, 0.0));
}

// A plane's share of the kernel's integral: ∫ V W over the plane at distance z, 0 ≤ z. Σ over planes one h apart is 1.
fn layer(z: f32) -> f32 {
    let a = max(2.0 - z, 0.0);
    let b = max(1.0 - z, 0.0);
    let a4 = a * a * a * a;
    let b4 = b * b * b * b;
    return a4 * (0.25 - 0.1 * a) - b4 * (0.5 - 0.4 * b);
}

// Derivative of `layer` by z, for z ≥ 0.
fn layer_slope(z: f32) -> f32 {
    return -6.2831853 * z * spline(z);
}

// What the fluid's mirror image in a plane surface adds to the fill of a point at distance d (in h) before it: layers
// one h apart, of which the first is the point's own. At h/2, where a regular filling begins, the filling just goes on.
// Behind the surface it goes on growing, so that what got there is pushed out.
fn mirrored(d: f32) -> f32 {
    let z = 2.0 * max(d, 0.0);
    return layer(z) + layer(z + 1.0) + min(d, 0.0) * mirrored_slope(0.0);
}

// Its derivative by d, in 1/h.
fn mirrored_slope(d: f32) -> f32 {
    let z = 2.0 * max(d, 0.0);
    return 2.0 * (layer_slope(z) + layer_slope(z + 1.0));
}

// Σ of the layers' slopes, each times its distance.
fn mirrored_moment(d: f32) -> f32 {
    let z = 2.0 * max(d, 0.0);
    return z * layer_slope(z) + (z + 1.0) * layer_slope(z + 1.0);
}

// Integrals of `rub` times r, and over r.
fn rub_up(r: f32) -> f32 {
    return 0.81549072 * r * r * (1.0 + 2.0 * ROUND - r * ((1.0 + 4.0 * ROUND) / 3.0 - 0.25 * ROUND * r));
}
fn rub_down(r: f32) -> f32 {
    return 0.81549072 * ((2.0 + 4.0 * ROUND) * log(r) - r * (1.0 + 4.0 * ROUND - 0.5 * ROUND * r));
}

// What a plane at distance z takes of a flow that comes to it: ∫ rub z (3/2 z²/r² − 1/2) over the plane, for a velocity
// (−x, y/2, z/2), as that of a liquid that is as far from a wall as x and evades to its sides.
fn layer_squeeze(z: f32) -> f32 {
    let r = clamp(z, 1e-3, 2.0);
    return 3.1415927 * min(z, 2.0) * (3.0 * r * r * (rub_down(2.0) - rub_down(r)) - rub_up(2.0) + rub_up(r));
}

// Of the fluid's mirror image, whose velocity along the normal is turned: viscosity takes so much of the velocity along
// it over the distance d, in ν/h².
fn mirrored_squeeze(d: f32) -> f32 {
    let z = 2.0 * max(d, 0.0);
    return layer_squeeze(z) + layer_squeeze(z + 1.0);
}

//! use lib/clock lib/reference lib/polar
//! family piola
// Stress at points of a body, and what the clock is told of it: whoever uses this has `reference` and `clock`.

// ‖F‖² above which the step has run away: no body is stretched that far, and what grows by itself soon is.
override MOST_STRETCH: f32 = 300.0;

// Waves so much faster than at rest are left to the margin of the Courant number.
override SLACK: f32 = 1.1;

var<private> squeezed: u32;
var<private> torn: u32;
var<private> stiffest: f32;

// F of a point from its derivatives a cell.
fn gradient(x: vec3f, y: vec3f, z: vec3f) -> mat3x3f {
    let inv = 1.0 / reference.dx;
    return mat3x3f(vec3f(1.0, 0.0, 0.0) + inv * x, vec3f(0.0, 1.0, 0.0) + inv * y, vec3f(0.0, 0.0, 1.0) + inv * z);
}

fn count(these: vec4<bool>) -> u32 {
    let one = select(vec4u(0u), vec4u(1u), these);
    return one.x + one.y + one.z + one.w;
}

// P at four points, times −V/dx: each stands for a share of a particle's volume, or is not there.
fn stress(solid: Solid, f: Four, share: vec4f) -> Four {
    let exists = share > vec4f(0.0);
    let size = vec4f(squares(f.a), squares(f.b), squares(f.c), squares(f.d));
    let volume = vec4f(determinant(f.a), determinant(f.b), determinant(f.c), determinant(f.d));
    let answer = piola(solid.material, solid, f);
    let stiff = select(vec4f(0.0), answer.stiff, exists);
    stiffest = max(max(stiffest, max(stiff.x, stiff.y)), max(stiff.z, stiff.w));
    squeezed += count(exists & (volume < vec4f(LEAST_VOLUME)));
    // NaN compares as false.
    torn += count(exists & !(size <= vec4f(MOST_STRETCH)));
    let kept = (-solid.volume / reference.dx) * share;
    return Four(kept.x * answer.p.a, kept.y * answer.p.b, kept.z * answer.p.c, kept.w * answer.p.d);
}

// Waves in what is deformed are faster than at rest, which shortens the next step.
fn tell_clock(solid: Solid) {
    let wave = solid.wave * sqrt(stiffest / (solid.lambda + 2.0 * solid.mu));
    if (wave > SLACK * clock.wave_speed) { atomicMax(&clock.speed_bits, bitcast<u32>(wave)); }
    if (squeezed > 0u) { atomicAdd(&clock.clamped_volume, squeezed); }
    if (torn > 0u) { atomicAdd(&clock.clamped_velocity, torn); }
}

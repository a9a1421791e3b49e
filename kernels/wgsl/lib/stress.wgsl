//! use lib/clock lib/deformed lib/polar lib/shock
//! family piola
// Stress at points of a body, and what the clock is told of it: whoever uses this has `reference` and `clock`.

// ‖F‖² above which the step has run away: no body is stretched that far, and what grows by itself soon is.
override MOST_STRETCH: f32 = 300.0;

// Waves so much faster than at rest are left to the margin of the Courant number.
override SLACK: f32 = 1.1;

// A body is damped.
override DAMPED: bool = false;

// Bodies may meet something faster than a quarter of their waves' speed.
override SHOCKED: bool = false;

// ω dx/(2 c) of the fastest vibration there may be: lattices of ragged bodies stand steps of 0.9 dx/c.
override QUICK: f32 = 1.1;

var<private> squeezed: u32;
var<private> torn: u32;
var<private> stiffest: f32;
var<private> thickest: f32;     // [m/s]

fn all_deformed(g: Four) -> Four {
    return Four(deformed(g.a), deformed(g.b), deformed(g.c), deformed(g.d));
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

// What damping adds to that: P = F S with S = β (2μ Ė + λ tr Ė), Ė the symmetric part of Fᵀ Ḟ (Kelvin–Voigt). It turns
// with the body, so that no motion as a whole is damped.
fn damped_at(solid: Solid, f: mat3x3f, rate: mat3x3f, share: f32) -> mat3x3f {
    let g = transpose(f) * rate;
    let swells = solid.lambda * (g[0].x + g[1].y + g[2].z);
    var s = solid.mu * (g + transpose(g));
    s[0].x += swells;
    s[1].y += swells;
    s[2].z += swells;
    return (-solid.damping * share * solid.volume / reference.dx) * (f * s);
}

// What a shock adds: the pressure q on cof F, with w = −dx (cof F : Ḟ)/|cof F| the speed at which a cell closes across its
// thinnest direction, and the density ρ/J.
fn shocked_at(solid: Solid, f: mat3x3f, rate: mat3x3f, share: f32) -> mat3x3f {
    let c = cofactor(f);
    let j = max(dot(f[0], c[0]), LEAST_VOLUME);
    let wide = sqrt(max(1.0, squares(c) - 2.0));
    let closing = -reference.dx * (dot(c[0], rate[0]) + dot(c[1], rate[1]) + dot(c[2], rate[2])) / wide;
    let fast = hurry(closing, solid.wave);
    // dq/dw a cell, over the density at rest.
    thickest = max(thickest, select(0.0, 2.0 * SHOCK * fast * wide / j, share > 0.0));
    return (SHOCK * solid.density * fast * fast / j * share * solid.volume / reference.dx) * c;
}

// What the rate of the deformation adds to forces at four points.
fn viscous(solid: Solid, p: Four, f: Four, rate: Four, share: vec4f) -> Four {
    var all = p;
    if (DAMPED) {
        all = Four(all.a + damped_at(solid, f.a, rate.a, share.x), all.b + damped_at(solid, f.b, rate.b, share.y),
            all.c + damped_at(solid, f.c, rate.c, share.z), all.d + damped_at(solid, f.d, rate.d, share.w));
    }
    if (SHOCKED) {
        all = Four(all.a + shocked_at(solid, f.a, rate.a, share.x), all.b + shocked_at(solid, f.b, rate.b, share.y),
            all.c + shocked_at(solid, f.c, rate.c, share.z), all.d + shocked_at(solid, f.d, rate.d, share.w));
    }
    return all;
}

// Waves in what is deformed are faster than at rest, which shortens the next step.
fn tell_clock(solid: Solid) {
    let undamped = solid.wave * sqrt(stiffest / (solid.lambda + 2.0 * solid.mu));
    // At Courant's limit ω dt = 2; with ζ of critical damping a step may have 1/(ζ + sqrt(1 + ζ²)) of that (Belytschko).
    // What is faster than any number stays so without damping.
    let z = select(0.0, QUICK * solid.damping * undamped / reference.dx, solid.damping > 0.0)
        + select(0.0, QUICK * thickest / undamped, thickest > 0.0);
    let wave = undamped * (z + sqrt(1.0 + z * z));
    if (wave > SLACK * clock.wave_speed) { atomicMax(&clock.speed_bits, bitcast<u32>(wave)); }
    if (squeezed > 0u) { atomicAdd(&clock.clamped_volume, squeezed); }
    if (torn > 0u) { atomicAdd(&clock.clamped_velocity, torn); }
}

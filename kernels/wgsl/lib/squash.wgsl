// What the volume term λ/2 (J − 1)² of fixed-corotated bodies gains below a third of their volume. By itself it is finite
// at J = 0, so that an impact at twice the speed of waves, or a weight of as many times E, turns cells inside out. The
// pressure b(J) = 12 λ (P/J − 2 + J/P), P = 1/3, begins with no slope at P, is 20 λ at 0.1 and 58 λ at 0.05, goes on
// along its tangent from there to 136 λ at 0, and stays that below.

const SQUASHED: f32 = 0.33333333;
const SQUASHED_STIFF: f32 = 12.0;
const SQUASHED_FLAT: f32 = 0.05;

// Pressure over λ, and its slope against J, reversed.
fn squash(j: f32) -> vec2f {
    let k = clamp(j, SQUASHED_FLAT, SQUASHED);
    let q = SQUASHED / k;
    let slope = SQUASHED_STIFF * (q / k - 1.0 / SQUASHED);
    return vec2f(SQUASHED_STIFF * (q - 2.0 + k / SQUASHED) + slope * (k - clamp(j, 0.0, k)), slope);
}

// Energy over λ.
fn squash_energy(j: f32) -> f32 {
    let k = clamp(j, SQUASHED_FLAT, SQUASHED);
    let more = k - clamp(j, 0.0, k);
    let b = squash(k);
    return SQUASHED_STIFF * (SQUASHED * log(SQUASHED / k) - 2.0 * (SQUASHED - k)
        + 0.5 * (SQUASHED * SQUASHED - k * k) / SQUASHED) + more * (b.x + 0.5 * more * b.y) - min(j, 0.0) * squash(0.0).x;
}

// Pressure of a shock. What meets faster than its waves run cannot give way in time, and springs alone would let cells
// turn inside out and ring on with energy that a shock turns to heat: a viscous pressure q = 1.5 ρ w² takes it (von
// Neumann & Richtmyer 1950, without the linear term), w the part of the closing speed above a quarter of the waves'.
// Slower motion feels nothing of it.

const SHOCK: f32 = 1.5;
const CALM: f32 = 0.25;

// Part of a closing speed that counts [m/s].
fn hurry(closing: f32, wave: f32) -> f32 { return max(0.0, closing - CALM * wave); }

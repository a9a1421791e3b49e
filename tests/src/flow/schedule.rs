//! Noise levels of a shifted schedule, written from its definition: σ = s t / (1 + (s − 1) t) with t from the clean end.

/// σ of step `index` of `steps`, counted from the clean end.
pub fn shifted(shift: f64, index: u32, steps: u32) -> f64 {
    let t = f64::from(index) / f64::from(steps);
    shift * t / (1.0 + (shift - 1.0) * t)
}

/// σ[0] … σ[last].
pub fn levels(shift: f64, last: u32, steps: u32) -> Vec<f64> {
    (0..=last).map(|i| shifted(shift, i, steps)).collect()
}

/// FramePack's shift for a latent of so many tokens: ln s = min(ln 7, 0.5 + 0.65 (tokens − 256)/3840).
pub fn framepack_shift(tokens: u32) -> f64 {
    (0.5 + 0.65 * (f64::from(tokens) - 256.0) / 3840.0).min(7f64.ln()).exp()
}

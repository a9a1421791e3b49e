//! F and F⁻¹: one step of the flow's equation dz/dσ = −v from one noise level to another. Knows no SDE.

/// z ← z + `a` v + `b` w, with v the velocity at the step's start.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FlowStep {
    /// Factor of the velocity.
    pub a: f64,
    /// Factor of the other velocity: the one of the step before (AB2), or of the step's start (Heun's corrector).
    pub b: f64,
}

/// Euler's step from noise level `from` to `to`.
pub fn euler(from: f64, to: f64) -> FlowStep {
    FlowStep { a: from - to, b: 0.0 }
}

/// Adams–Bashforth of second order with a step before from `before` to `from`; w is the velocity at `before`.
/// z + (1 + h/2h') h f − (h/2h') h f', f = −v.
pub fn ab2(before: f64, from: f64, to: f64) -> FlowStep {
    let (h, earlier) = (to - from, from - before);
    if earlier == 0.0 {
        return euler(from, to);
    }
    let ratio = 0.5 * h / earlier;
    FlowStep { a: -h * (1.0 + ratio), b: h * ratio }
}

/// Heun's second half, after an Euler step from `from` to `to`: v is the velocity at its end, w at its start.
pub fn heun_corrector(from: f64, to: f64) -> FlowStep {
    FlowStep { a: 0.5 * (from - to), b: -0.5 * (from - to) }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// dz/dσ = σ² has v = −σ²: AB2 and Heun are exact but for the third derivative, Euler is not.
    #[test]
    fn second_order_steps_are_exact_for_linear_velocities() {
        let (s0, s1, s2) = (0.2, 0.35, 0.6);
        let v = |s: f64| -2.0 * s;
        let z = |s: f64| s * s;
        let ab = ab2(s0, s1, s2);
        assert!((z(s1) + ab.a * v(s1) + ab.b * v(s0) - z(s2)).abs() < 1e-15);
        let e = euler(s1, s2);
        let c = heun_corrector(s1, s2);
        let predicted = z(s1) + e.a * v(s1);
        assert!((predicted - z(s2)).abs() > 0.05);
        assert!((predicted + c.a * v(s2) + c.b * v(s1) - z(s2)).abs() < 1e-15);
    }
}

//! Viscosity alone: a free cylinder whose ends turn against each other; the same solved for in steps that explicit
//! viscosity does not stand.

use physvideo::fluid::Fluid;
use physvideo::scene::{Pressure, Viscosity};
use physvideo_gpu::{Gpu, Options};
use physvideo_tests::problems::viscous::{Flow, Twist, twist};
use physvideo_tests::{device, folder};

fn cylinder(pressure: Pressure, viscosity: Viscosity, turned: bool) -> Twist {
    Twist { turned, step: 0.5, frames: [4, 60], fluid: Fluid { pressure, viscosity, ..Default::default() } }
}

fn sound(flow: &Flow) -> bool {
    flow.frames.iter().all(|f| f.clamped_velocity + f.quarantined + f.rejected + f.unsolved == 0)
}

/// By how much the viscosity that a cylinder's decay shows is off.
fn off(gpu: &Gpu, t: &Twist) -> f64 {
    let (flow, x) = twist(gpu, t).unwrap();
    assert!(sound(&flow), "{:?}", flow.frames);
    let steps = (t.frames[0] * t.frames[1]) as f64;
    // Forward Euler keeps 1 − x of a mode in a step.
    flow.speeds[t.frames[0] - 1].ln() / (steps * (-x).ln_1p()) - 1.0
}

/// What a body shows depends a little on its surface, a staircase on the lattice: 0.6 h over its radius of the viscosity
/// is missing (the same at twice the length, half of it at nearly twice the radius).
#[test]
fn a_twist_decays_as_its_viscosity_says_however_the_lattice_lies() {
    let gpu = device::gpu();
    for pressure in [Pressure::Wcsph, Pressure::Dfsph] {
        let [along, across] = [false, true].map(|turned| off(&gpu, &cylinder(pressure, Viscosity::Explicit, turned)));
        for error in [along, across] {
            assert!((-0.11..0.01).contains(&error), "{pressure:?}: viscosity is off by {error:.4}");
        }
        assert!((along - across).abs() < 0.08, "{pressure:?}: {along:.4} one way and {across:.4} the other");
    }
}

/// Control: with Monaghan's weight, 2 (d + 2) = 10 times the spline's slope, shear along the axes of a lattice has half
/// the viscosity of shear across.
#[test]
fn the_splines_slope_has_another_viscosity_in_every_direction() {
    let copy = tempfile::tempdir().unwrap();
    folder::copy_kernels(copy.path());
    let (rub, spline) =
        ("rub(r * inv_h) * between", "-10.0 * spline_slope(r * inv_h) / max(r * inv_h, 1e-6) * between");
    folder::edit(copy.path(), "sph/force", rub, spline);
    let gpu = device::open(Options { wgsl: Some(copy.path().into()), validation: false, ..device::options() });
    let [along, across] =
        [false, true].map(|turned| off(&gpu, &cylinder(Pressure::Dfsph, Viscosity::Explicit, turned)));
    assert!(along < -0.25 && across - along > 0.25, "{along:.4} one way and {across:.4} the other");
}

/// Steps a hundred times as long as explicit viscosity stands: backward Euler keeps 1/(1 + x) of the speed in each, x the
/// rate that explicit viscosity shows in short ones.
#[test]
fn a_solve_stands_any_step_and_slows_as_backward_euler_does() {
    let gpu = device::gpu();
    for turned in [false, true] {
        let shown = 1.0 + off(&gpu, &cylinder(Pressure::Dfsph, Viscosity::Explicit, turned));
        let long = Twist { step: 100.0, frames: [3, 1], ..cylinder(Pressure::Dfsph, Viscosity::Implicit, turned) };
        let (flow, x) = twist(&gpu, &long).unwrap();
        assert!(sound(&flow) && flow.frames.iter().all(|f| f.iterations > 0), "{:?}", flow.frames);
        for (n, speed) in (1..).zip(&flow.speeds) {
            let want = (1.0 + shown * x).powi(-n);
            // The start is the mode of a round cylinder, not quite that of its particles.
            assert!((speed / want - 1.0).abs() < 0.02, "step {n}: {speed:.4} for {want:.4}");
        }
        // Controls: the exact decay, which such steps cannot follow, is told apart; without a solve they fail.
        assert!((flow.speeds[0] / (-shown * x).exp() - 1.0).abs() > 0.15, "exp(−{x:.2}) passes for 1/(1 + {x:.2})");
        let fluid = Fluid { viscosity: Viscosity::Explicit, ..long.fluid };
        let (flow, _) = twist(&gpu, &Twist { fluid, ..long }).unwrap();
        assert!(!sound(&flow) || flow.speeds[2] > 1.0, "explicit viscosity stands a hundred times its limit");
    }
}

/// Where both stand, they agree.
#[test]
fn a_solve_agrees_with_explicit_viscosity() {
    let gpu = device::gpu();
    let speeds = |viscosity| twist(&gpu, &cylinder(Pressure::Wcsph, viscosity, false)).unwrap();
    let ((explicit, x), (implicit, _)) = (speeds(Viscosity::Explicit), speeds(Viscosity::Implicit));
    assert!(sound(&implicit) && sound(&explicit));
    // Its sums follow the particles' numbers, whoever claimed which block.
    assert_eq!(speeds(Viscosity::Implicit).0.speeds, implicit.speeds, "two runs differ");
    // A step keeps 1 − x of the mode, or 1/(1 + x), which is x² more; a solve leaves a thousandth of what it changes.
    let rate = -explicit.speeds[3].ln() / (240.0 * x);
    let between = (240.0 * (rate * x).powi(2)).exp();
    let apart = (implicit.speeds[3] / explicit.speeds[3] / between - 1.0).abs();
    assert!(apart < 5e-3, "{apart:.4}: {:.4?}, {:.4?}", explicit.speeds, implicit.speeds);
    // Control: another viscosity is told apart.
    assert!((explicit.speeds[3].powf(0.05) - 1.0).abs() > 5e-3, "5 % of the viscosity pass for none");
}

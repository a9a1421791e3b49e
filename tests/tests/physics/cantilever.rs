//! M7 in the form for CI: a beam clamped at x = 0 under its own weight, L/h = 5, four cells thick, plane strain, load
//! w L³ / (E I) = 1, where the inextensible elastica (Bisshopp & Drucker 1945, dead uniform load) sinks 0.12347 L.

use physvideo::scene::Material;
use physvideo_gpu::kernels::Field;
use physvideo_tests::device::gpu;

use super::setup::{between, body, fill, plane, solver, world};

/// Tip deflection over length, for a load `load` and either gradient.
fn sag(load: f64, true_gradient: bool) -> f64 {
    let gpu = gpu();
    // The plane below holds the nodes at x ≤ 0 and acts 0.3 cells behind them (see the bar): the clamp is there.
    let (dx, cells, free): (f64, f64, f64) = (1.0, 4.0, 20.0);
    let length = free + 0.3 * dx;
    let (young, nu, density) = (1e4, 0.3, 1.0);
    let thick = cells * dx;
    let beam = fill(dx, [-3.0 * dx, 0.0, 0.0], [free, thick, 2.0 * dx], |_| true);
    let material = Material::Elastic { young: young as f32, poisson: nu as f32 };
    let mut w = world(
        vec![body(material, density, dx, beam, |_| [0.0; 3])],
        dx,
        [-4.0, -14.0, 0.0],
        [length + 3.0, thick + 4.0, 2.0 * dx],
    );
    let stiffness = young / (1.0 - nu * nu) * thick.powi(2) / 12.0;
    let g = load * stiffness / (density * length.powi(3));
    // First bending period; the load comes on over three of them, so that little is left to swing.
    let period = std::f64::consts::TAU * length * length / 3.516 / (stiffness / density).sqrt();
    w.fields = vec![Field {
        kind: 1,
        start: 0.0,
        end: 1e9,
        ramp: (3.0 * period) as f32,
        a: [0.0, -g as f32, 0.0, 0.0],
        ..Default::default()
    }];
    w.colliders = vec![plane([0.0; 3], [1.0, 0.0, 0.0], true)];
    w.colliders.extend(between(dx, 2.0));
    let mut mpm = solver(&gpu, &w, true_gradient);
    let tip = |mpm: &physvideo::stages::mpm::Mpm| {
        let particles = gpu.read(mpm.particles).unwrap();
        let at = |p: &&physvideo_gpu::kernels::Particle| p.x[0] as f64 > 0.0;
        // The end face: the last column of particles, half a spacing inside.
        let mut far: Vec<_> =
            particles.iter().enumerate().filter(|(i, _)| i % 46 == 45).map(|(_, p)| p).filter(at).collect();
        far.sort_by(|a, b| a.x[1].total_cmp(&b.x[1]));
        far.iter().map(|p| f64::from(p.x[1])).sum::<f64>() / far.len() as f64
    };
    let before = tip(&mpm);
    mpm.frame((3.0 * period) as f32).unwrap();
    // What still swings averages out over a period.
    let mut sum = 0.0;
    for _ in 0..8 {
        mpm.frame((period / 8.0) as f32).unwrap();
        sum += tip(&mpm) / 8.0;
    }
    (before - sum) / length
}

#[test]
fn a_beam_sags_as_the_elastica() {
    let exact = 0.12347;
    let got = sag(1.0, true);
    println!("cantilever: tip {got:.5} of {exact}: {:+.1} %", 100.0 * (got / exact - 1.0));
    // Shear adds about (h/L)² = 4 %, the grid 4 % at this thickness.
    assert!((got / exact - 1.0).abs() < 0.08, "tip {got}, exact {exact}");
}

/// Controls: a quarter more load must show; and the MLS gradient sags further than the true one, which is why the
/// true one is the default.
#[test]
fn a_heavier_beam_and_the_mls_gradient_are_told_apart() {
    let heavier = sag(1.25, true);
    assert!((heavier / 0.12347 - 1.0).abs() > 0.12, "tip {heavier}");
    let (mls, own) = (sag(1.0, false), sag(1.0, true));
    println!("cantilever: MLS gradient {mls:.5}, true gradient {own:.5}");
    assert!(mls > 1.01 * own, "MLS {mls}, true {own}");
}

//! M6: two elastic discs in plane strain meet and part (Sulsky 1994): radius 0.2, speed 0.1·√2 each, E 1000, ν 0.3,
//! ρ 1000 in the unit square.

use physvideo::scene::Material;
use physvideo_tests::device::gpu;

use super::setup::{between, body, fill, solver, world};

const SPEED: f64 = 0.1;

#[test]
fn discs_collide() {
    let gpu = gpu();
    let dx = 1.0 / 32.0;
    let disc = |c: f64| fill(dx, [0.0; 3], [1.0, 1.0, 2.0 * dx], |x| (x[0] - c).hypot(x[1] - c) < 0.2);
    let material = Material::Elastic { young: 1000.0, poisson: 0.3 };
    let toward = |s: f64| move |_: [f32; 3]| [(s * SPEED) as f32, (s * SPEED) as f32, 0.0];
    let bodies =
        vec![body(material, 1000.0, dx, disc(0.2), toward(1.0)), body(material, 1000.0, dx, disc(0.8), toward(-1.0))];
    let mut w = world(bodies, dx, [-0.2, -0.2, 0.0], [1.2, 1.2, 2.0 * dx]);
    w.courant = 0.4;
    w.colliders = between(dx, 2.0).to_vec();
    let mut mpm = solver(&gpu, &w, true);
    let energy = |mpm: &physvideo::stages::mpm::Mpm| {
        let (a, b) = (mpm.measure(0).unwrap(), mpm.measure(1).unwrap());
        let momentum: f64 = (0..2).map(|i| (a.momentum[i] + b.momentum[i]).abs()).fold(0.0, f64::max);
        (a.kinetic + b.kinetic + a.elastic + b.elastic, a.kinetic + b.kinetic, momentum, a.momentum[0] / a.mass)
    };
    let (start, _, _, _) = energy(&mpm);
    let per_length = start / (2.0 * dx);
    // Both discs: ½ ρ π r² · 2 · (0.1² + 0.1²) = 2.51327 J/m, less what a 6-cell radius leaves of the circles.
    assert!((per_length / 2.513_27 - 1.0).abs() < 0.02, "kinetic energy {per_length} J/m");
    let (mut last, mut contact, mut slowest) = (start, None, f64::MAX);
    let step = 0.02;
    for i in 1..=150 {
        mpm.frame(step as f32).unwrap();
        let (total, kinetic, momentum, _) = energy(&mpm);
        let mass = 2.0 * 1000.0 * 0.04 * std::f64::consts::PI * 2.0 * dx;
        assert!(momentum < 1e-5 * mass * SPEED, "momentum {momentum} at frame {i}");
        // Rounding in f32 sums of the energies: 1e-5.
        assert!(total < last * (1.0 + 1e-5), "energy rises at frame {i}: {last} → {total}");
        last = total;
        slowest = slowest.min(kinetic);
        if contact.is_none() && kinetic < 0.97 * start {
            contact = Some(f64::from(i) * step);
        }
    }
    let contact = contact.expect("they meet");
    let (end, _, _, away) = energy(&mpm);
    println!("discs: contact {contact:.3} s, loss {:.1} %, leaving at {away:.4} m/s", 100.0 * (1.0 - end / start));
    // Geometric contact is at 1.58579 s; grids feel each other up to 15 dx s early, and the kinetic energy needs a
    // moment to show it.
    assert!((1.585_79 - 15.0 * dx..1.75).contains(&contact), "contact at {contact} s");
    // They stop each other almost, and part: the sign of the motion turns.
    assert!(slowest < 0.2 * start && away < -0.5 * SPEED, "slowest {slowest}, leaving at {away}");
    // APIC loses 15 % at 32 cells in two dimensions and f64 (the design's figure). Measured here, in a slab two cells
    // thick between planes and f32: 21 %. The bound keeps that figure from getting worse.
    assert!(end / start > 0.77, "loss {}", 1.0 - end / start);
}

//! Fast and heavy: impacts, a thousandfold density, speeds that are none.

use physvideo::scene::Material;

use super::step::drop;
use super::{Bound, Case, ELASTIC, EVERY, MATERIALS, PARTICLES, Setup, Verdict};
use crate::problems::setup::Lattice;

/// What bodies on grids of their own are made of.
const BOUNCY: &[&str] = &["elastic", "neo_hookean"];
const ANY: &[Verdict] = &[Verdict::Clean, Verdict::Counted, Verdict::TakenBack];

fn impact(material: Material, speed: f64) -> Setup {
    let mut s = drop(material, 1000.0, speed);
    s.length = 2e-3;
    s.frames = 8;
    s
}

/// Two cubes that meet in the air, each at half of `speed`.
fn meeting(material: Material, speed: f64) -> Setup {
    let mut s = impact(material, 0.5 * speed);
    let lattice = Lattice::of_eight(super::step::DX);
    let cube = lattice.fill([0.0, 0.0, 0.3], [0.25, 0.25, 0.55], |_| true);
    s.world.gravity = [0.0; 3];
    s.world.colliders.clear();
    s.world.bodies = vec![
        lattice.body(material, 1000.0, &cube, |_| [0.0, 0.0, -0.5 * speed]),
        lattice.body(material, 1000.0, &lattice.fill([0.0, 0.0, 0.035], [0.25, 0.25, 0.285], |_| true), |_| {
            [0.0, 0.0, 0.5 * speed]
        }),
    ];
    s
}

/// A cube a thousand times as dense on top of another.
fn heavy(material: Material) -> Setup {
    let mut s = drop(material, 1.0, 0.0);
    let lattice = Lattice::of_eight(super::step::DX);
    let cube = lattice.fill([0.0, 0.0, 0.3], [0.25, 0.25, 0.55], |_| true);
    s.world.bodies.push(lattice.body(material, 1000.0, &cube, |_| [0.0; 3]));
    (s.frames, s.length) = (5, 0.03);
    s
}

/// Everything moves sideways and out of the grid within the first frames.
fn leaving(material: Material) -> Setup {
    let mut s = drop(material, 1000.0, 0.0);
    s.world.bodies[0].velocities.iter_mut().for_each(|v| *v = [30.0, 0.0, 0.0]);
    s.length = 0.05;
    s
}

fn wild(material: Material) -> Setup {
    let mut s = drop(material, 1000.0, 0.0);
    s.world.bodies[0].velocities[100] = [0.0, 1e30, 0.0];
    s
}

const fn case(
    name: &'static str,
    solvers: &'static [&'static str],
    expect: &'static [Verdict],
    setup: fn(Material) -> Setup,
) -> Case {
    Case { name, solvers, materials: &MATERIALS, large: false, repeats: true, expect, elsewhere: ANY, setup }
}

pub const CASES: [Case; 8] = [
    case("impact at 40 m/s", EVERY, ANY, |m| impact(m, 40.0)),
    case("impact at 50 m/s", EVERY, ANY, |m| impact(m, 50.0)),
    case("impact at 100 m/s", EVERY, ANY, |m| impact(m, 100.0)),
    Case { materials: BOUNCY, ..case("two bodies that meet at 20 m/s", ELASTIC, ANY, |m| meeting(m, 20.0)) },
    Case { materials: BOUNCY, ..case("two bodies that meet at 40 m/s", ELASTIC, ANY, |m| meeting(m, 40.0)) },
    case("a thousandfold density on top", PARTICLES, ANY, heavy),
    case("leaving the domain at 30 m/s", EVERY, &[Verdict::Counted], leaving),
    Case {
        elsewhere: &[Verdict::Refused],
        ..case("one particle at 1e30 m/s", EVERY, &[Verdict::Refused], |m| Setup {
            bound: Bound::SpeedLimit,
            ..wild(m)
        })
    },
];

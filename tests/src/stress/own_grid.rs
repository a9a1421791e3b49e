//! States of the nodes of bodies on grids of their own that no run should start from.

use physvideo::scene::Material;

use super::step::drop;
use super::{ANYTHING, Bound, Case, ELASTIC, Nodes, Setup, Verdict};

/// The drop's cube, 0.1 m above the ground, with nodes displaced from their place x by `nodes`.
fn displaced(material: Material, nodes: Nodes) -> Setup {
    let mut s = drop(material, 1000.0, 0.0);
    s.world.bodies[0].positions.iter_mut().for_each(|x| x[2] += 0.1);
    Setup { nodes: Some(nodes), bound: Bound::SpeedLimit, ..s }
}

/// By diag(`scale`) about the middle of the cube.
fn scaled(x: [f64; 3], scale: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let middle = [0.125, 0.125, 0.23];
    (std::array::from_fn(|a| (scale[a] - 1.0) * (x[a] - middle[a])), [0.0; 3])
}

/// One node is nowhere, another infinitely fast.
fn not_finite(x: [f64; 3]) -> ([f64; 3], [f64; 3]) {
    let near = |at: [f64; 3]| (0..3).all(|a| (x[a] - at[a]).abs() < 0.03);
    let u = if near([0.1, 0.1, 0.2]) { f64::NAN } else { 0.0 };
    let v = if near([0.2, 0.2, 0.2]) { f64::INFINITY } else { 0.0 };
    ([0.0, u, 0.0], [v, 0.0, 0.0])
}

/// Squeezed by its own motion until F passes through 0 and comes out inside out.
fn imploding(material: Material) -> Setup {
    let mut s = drop(material, 1000.0, 0.0);
    let body = &mut s.world.bodies[0];
    body.positions.iter_mut().for_each(|x| x[2] += 0.5);
    let middle = [0.125, 0.125, 0.63];
    body.velocities = body.positions.iter().map(|x| std::array::from_fn(|a| -200.0 * (x[a] - middle[a]))).collect();
    (s.length, s.frames) = (5e-3, 6);
    s
}

const fn case(
    name: &'static str,
    solvers: &'static [&'static str],
    expect: &'static [Verdict],
    setup: fn(Material) -> Setup,
) -> Case {
    let materials = &["elastic", "neo_hookean"];
    Case { name, solvers, materials, large: false, repeats: true, expect, elsewhere: ANYTHING, setup }
}

const OWN: &[&str] = &["total_lagrangian"];

pub const CASES: [Case; 5] = [
    case("nodes: NaN and infinity", OWN, &[], |m| displaced(m, not_finite)),
    case("nodes: F near 0", OWN, &[], |m| displaced(m, |x| scaled(x, [1e-3; 3]))),
    case("nodes: F flat", OWN, &[], |m| displaced(m, |x| scaled(x, [1e-3, 1.0, 1.0]))),
    case("nodes: F inside out", OWN, &[], |m| displaced(m, |x| scaled(x, [-1.0, 1.0, 1.0]))),
    case("imploding until F passes through 0", ELASTIC, ANYTHING, imploding),
];

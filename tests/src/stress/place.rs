//! Odd bodies in odd places: one particle, none, coincident ones, cell and domain borders, walls that close in.

use physvideo::fluid::SOUND;
use physvideo::scene::Material;
use physvideo::world::Emission;
use physvideo_gpu::kernels::{Collider, family};

use super::step::{DX, drop};
use super::{ANYTHING, Bound, Case, EVERY, LIQUIDS, MATERIALS, PARTICLES, Setup, Verdict};
use crate::liquid::room;
use crate::problems::setup::{Lattice, plane, world};

const ANY: &[Verdict] = &[Verdict::Clean, Verdict::Counted, Verdict::TakenBack];
/// A grid of its own is made of particles.
const NONE: &[Verdict] = &[Verdict::Clean, Verdict::Refused];

/// The drop with these particles instead of a cube.
fn at(material: Material, places: &[[f64; 3]]) -> Setup {
    let mut s = drop(material, 1000.0, 0.0);
    s.world.bodies = vec![Lattice::of_eight(DX).body(material, 1000.0, places, |_| [0.0, 0.0, -1.0])];
    s
}

/// A liquid of SPH that starts too dense, or inside a wall, flies apart: what it is pressed together by is not measured.
fn pressed(s: Setup) -> Setup {
    let sph = s.world.bodies.iter().any(|b| matches!(b.material, Material::Sph { .. }));
    Setup { bound: if sph { Bound::SpeedLimit } else { s.bound }, ..s }
}

/// On nodes, on the faces where the particle's cell changes, and on the domain's corners.
fn borders(material: Material) -> Setup {
    let mut places: Vec<[f64; 3]> =
        (0..64).map(|i| [i % 4, i / 4 % 4, i / 16].map(|c| f64::from(c) * 0.5 * DX)).collect();
    places.extend([[-2.0, -2.0, -0.5], [2.25, 2.25, 2.0], [-2.0, 2.25, 0.0], [-2.0, 0.0, 2.0]]);
    let mut s = at(material, &places);
    // Those in the corners would fall out of it.
    s.world.gravity = [0.0; 3];
    s.world.bodies[0].velocities.fill([0.0; 3]);
    s.bound = Bound::Energy(1.05, 1e-9);
    pressed(s)
}

/// Walls that take 0.25 s to close to half the width of what fills the room.
pub fn crushed(material: Material) -> Setup {
    let lattice = Lattice::of_eight(DX);
    let cube = lattice.fill([0.0; 3], [0.25; 3], |_| true);
    let mut w = world(vec![lattice.body(material, 1000.0, &cube, |_| [0.0; 3])], DX, [-0.25; 3], [0.5; 3]);
    let wall = |x: f64, toward: f32| Collider {
        velocity: [0.25 * toward, 0.0, 0.0, 0.0],
        end: 0.25,
        ..plane([x, 0.0, 0.0], [toward, 0.0, 0.0], false)
    };
    w.colliders = vec![wall(0.0, 1.0), wall(0.25, -1.0)];
    for axis in 1..3 {
        let unit = |sign: f32| std::array::from_fn(|a| if a == axis { sign } else { 0.0 });
        w.colliders.push(plane([0.0; 3], unit(1.0), false));
        w.colliders.push(plane([0.25; 3], unit(-1.0), false));
    }
    // Work against a pressure of at most M at the full volume, grown thirtyfold by hardening or the liquid's law.
    let sound = if matches!(material, Material::Sph { .. }) { SOUND } else { w.wave_speeds().1 };
    let bound = Bound::Energy(1.0, 30.0 * f64::from(sound).powi(2) * 1000.0 * 0.25f64.powi(3));
    Setup { length: 0.06, bound, ..Setup::new(w) }
}

/// A nozzle of 4 × 4 particles fills a closed room at 20 m/s for 75 ms, half as full as it can be, what is there for 50 ms
/// is taken out and sent again.
fn jet(material: Material) -> Setup {
    let (spacing, speed, copies) = (0.5 * DX, 20.0, 48);
    let nozzle: Vec<[f64; 3]> = (0..16).map(|i| [i % 4, i / 4, 12].map(|c| (f64::from(c) + 0.5) * spacing)).collect();
    let places = nozzle.repeat(copies);
    let mut body = Lattice::of_eight(DX).body(material, 1000.0, &places, |_| [0.0, 0.0, -speed]);
    let period = spacing / speed;
    let emission = Emission { start: 0.0, end: 1.0, period, delays: vec![0.0; 16], lifetime: Some(0.05) };
    let energy = 0.5 * 1000.0 * spacing.powi(3) * places.len() as f64 * speed * speed;
    body.emission = Some(emission);
    let mut w = world(vec![body], DX, [-0.25; 3], [0.5; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![room([0.0; 3], [0.25, 0.25, 0.5])];
    // All that leaves the nozzle, and its fall.
    Setup { frames: 15, length: 5e-3, bound: Bound::Energy(1.05, 1.05 * energy), ..Setup::new(w) }
}

/// Water three cells deep in a room of 12 × 2 cells, from above which a block as deep as the room comes down to the floor.
fn plunged(material: Material, wide: f64) -> Setup {
    let [long, deep, high] = [12.0, 2.0, 3.0].map(|n| n * DX);
    let lattice = Lattice::of_eight(DX);
    let water = lattice.fill([0.0; 3], [long, deep, high], |_| true);
    let speed = 1.0;
    let block = Collider {
        shape: family::shape::BOX,
        velocity: [0.0, 0.0, -speed, 0.0],
        end: (high + 0.5 * DX) as f32 / speed,
        ..room([0.5 * (long - wide), -1.0, high + 0.5 * DX], [0.5 * (long + wide), 1.0, high + 1.0])
    };
    let low = [-0.1; 3];
    let mut w =
        world(vec![lattice.body(material, 1000.0, &water, |_| [0.0; 3])], DX, low, [long + 0.1, deep + 0.1, 1.2]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![room([0.0; 3], [long, deep, 1.0]), block];
    // It may give what it would at its speed with the water's whole mass.
    let mass = 1000.0 * long * deep * high;
    Setup { frames: 10, length: 0.03, bound: Bound::Energy(1.05, mass * f64::from(speed * speed)), ..Setup::new(w) }
}

fn empty(material: Material) -> Setup {
    let mut s = at(material, &[]);
    s.world.bodies.clear();
    s
}

const fn case(
    name: &'static str,
    materials: &'static [&'static str],
    expect: &'static [Verdict],
    setup: fn(Material) -> Setup,
) -> Case {
    Case { name, solvers: EVERY, materials, large: false, repeats: true, expect, elsewhere: ANY, setup }
}

pub const CASES: [Case; 11] = [
    case("one particle", &MATERIALS, ANY, |m| at(m, &[[0.1, 0.1, 0.05]])),
    // Not half a cell apart.
    Case {
        elsewhere: ANYTHING,
        ..case("two particles", &MATERIALS, ANY, |m| at(m, &[[0.1, 0.1, 0.05], [0.13, 0.1, 0.05]]))
    },
    // On no lattice.
    Case {
        elsewhere: ANYTHING,
        ..case("64 particles in one place", &MATERIALS, ANY, |m| pressed(at(m, &[[0.1; 3]; 64])))
    },
    // One of them is half a metre below the ground.
    Case { elsewhere: ANYTHING, ..case("on the borders of cells and domain", &MATERIALS, ANY, borders) },
    // Nothing halves the volume of what is incompressible.
    Case { elsewhere: ANYTHING, ..case("walls close to half the volume", &MATERIALS, ANY, crushed) },
    Case {
        solvers: LIQUIDS,
        ..case("a block that comes down on the floor", &["liquid"], ANY, |m| plunged(m, 4.0 * DX))
    },
    Case {
        solvers: LIQUIDS,
        elsewhere: &[Verdict::Refused],
        ..case("a lid that leaves no room", &["liquid"], ANY, |m| plunged(m, 14.0 * DX))
    },
    Case { solvers: PARTICLES, ..case("a nozzle at 20 m/s into a closed room", &["liquid"], ANY, jet) },
    case("no bodies", &["elastic"], &[Verdict::Clean], empty),
    Case { elsewhere: NONE, ..case("a body of no particles", &["elastic"], &[Verdict::Clean], |m| at(m, &[])) },
    Case {
        elsewhere: NONE,
        ..case("a body of no particles beside another", &["elastic"], &[Verdict::Clean], |m| {
            let mut s = drop(m, 1000.0, 1.0);
            s.world.bodies.insert(0, at(m, &[]).world.bodies.remove(0));
            Setup { bound: Bound::Energy(1.05, 0.0), ..s }
        })
    },
];

//! Steps around and far beyond the limit, and materials that ask for short ones.

use physvideo::scene::Material;
use physvideo::world::{World, ground};

use super::{Bound, Case, ELASTIC, EVERY, MATERIALS, MPM, Setup, Verdict, stiffer};
use crate::problems::setup::{Lattice, world};

/// Cell size of the small cases [m].
pub const DX: f64 = 1.0 / 16.0;

impl Setup {
    /// A world as it is built, and nothing of its own.
    pub fn new(world: World) -> Self {
        let bound = Bound::Energy(1.05, 0.0);
        Self { world, spoil: |_, _| {}, nodes: None, forced: None, frames: 5, length: 0.02, bound }
    }
}

const SOME: [&str; 4] = ["elastic", "snow", "sand", "liquid"];
const CLEAN: &[Verdict] = &[Verdict::Clean];
const ANY: &[Verdict] = &[Verdict::Clean, Verdict::Counted, Verdict::TakenBack];
/// The first step does not know of the stretch that was written into the particles.
const FIRST: &[Verdict] = &[Verdict::Clean, Verdict::TakenBack];
const COUNTED: &[Verdict] = &[Verdict::Counted];

/// A cube of four cells of `density` that comes down on the ground at `speed` [m/s], from 5 mm above it.
pub fn drop(material: Material, density: f64, speed: f64) -> Setup {
    let lattice = Lattice::of_eight(DX);
    let cube = lattice.fill([0.0, 0.0, 0.005], [0.25, 0.25, 0.255], |_| true);
    let body = lattice.body(material, density, &cube, |_| [0.0, 0.0, -speed]);
    let mut w = world(vec![body], DX, [-2.0, -2.0, -0.5], [2.25, 2.25, 2.0]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.3)];
    Setup { frames: 5, length: 0.02, bound: Bound::Energy(1.05, 0.0), ..Setup::new(w) }
}

/// The drop with a step forced to `times` what the engine would take at the start.
fn forced(material: Material, times: f64) -> Setup {
    let mut s = drop(material, 1000.0, 1.0);
    s.forced = Some(times);
    if times > 1.0 {
        s.bound = Bound::SpeedLimit;
    }
    s
}

/// The drop with a material `times` as stiff, for frames as much shorter.
fn stiff(material: Material, times: f32) -> Setup {
    let mut s = drop(stiffer(material, times), 1000.0, 1.0);
    s.length /= f64::from(times).sqrt() / 4.0;
    s
}

/// The paper's cube on `cells` cells a metre, its step forced to `dt` [s]; 0 leaves the choice to the engine.
fn paper(material: Material, cells: f64, dt: f64) -> Setup {
    let lattice = Lattice::of_eight(1.0 / cells);
    let edge = (0.06 * cells).round() / cells;
    let cube = lattice.fill([0.0, 0.0, 0.002], [edge, edge, edge + 0.002], |_| true);
    let body = lattice.body(material, 40.0, &cube, |_| [0.0, 0.0, -1.0]);
    let mut w = world(vec![body], lattice.dx, [-0.3, -0.3, -0.1], [0.4, 0.4, 0.4]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.2)];
    w.force_dt = (dt > 0.0).then_some(dt as f32);
    // A 30th of a second, eight of the paper's frames.
    let bound = if dt > 1.3e-4 { Bound::SpeedLimit } else { Bound::Energy(1.05, 0.0) };
    Setup { frames: 8, length: 4e-3, bound, ..Setup::new(w) }
}

/// Honey on small cells, `times` its own step where that is more than once.
fn honey(times: f64) -> Setup {
    let lattice = Lattice::of_eight(1.0 / 128.0);
    let thick = Material::Liquid { bulk: 1e4, exponent: 7.0, viscosity: 5.0 };
    let cube = lattice.fill([0.0, 0.0, 0.001], [0.0625, 0.0625, 0.0635], |_| true);
    let mut w =
        world(vec![lattice.body(thick, 1000.0, &cube, |_| [0.0, 0.0, -1.0])], lattice.dx, [-0.2, -0.2, -0.1], [0.3; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.3)];
    let bound = if times > 1.0 { Bound::SpeedLimit } else { Bound::Energy(1.05, 0.0) };
    Setup { frames: 3, length: 0.01, bound, forced: (times > 1.0).then_some(times), ..Setup::new(w) }
}

/// Snow as it hardens most, between walls that close to half its width.
fn hardened() -> Setup {
    let snow = Material::Snow {
        young: 1.4e5,
        poisson: 0.2,
        critical_compression: 0.025,
        critical_stretch: 0.0075,
        hardening: 20.0,
    };
    super::place::crushed(snow)
}

const fn small(
    name: &'static str,
    materials: &'static [&'static str],
    solvers: &'static [&'static str],
    expect: &'static [Verdict],
    setup: fn(Material) -> Setup,
) -> Case {
    Case { name, solvers, materials, large: false, repeats: true, expect, elsewhere: expect, setup }
}

/// Of so many particles that what is left of them crowds in a few cells.
const fn blown(name: &'static str, expect: &'static [Verdict], setup: fn(Material) -> Setup) -> Case {
    Case {
        name,
        solvers: ELASTIC,
        materials: &["elastic"],
        large: false,
        repeats: false,
        expect,
        elsewhere: ANY,
        setup,
    }
}

pub const CASES: [Case; 20] = [
    small("step 0.25 of the engine's", &SOME, EVERY, CLEAN, |m| forced(m, 0.25)),
    small("step 0.5 of the engine's", &SOME, EVERY, CLEAN, |m| forced(m, 0.5)),
    small("step 1 of the engine's", &SOME, EVERY, CLEAN, |m| forced(m, 1.0)),
    small("step 2 of the engine's, forced", &SOME, EVERY, ANY, |m| forced(m, 2.0)),
    Case { elsewhere: ANY, ..small("step 4 of the engine's, forced", &SOME, EVERY, COUNTED, |m| forced(m, 4.0)) },
    Case { elsewhere: ANY, ..small("step 8 of the engine's, forced", &SOME, EVERY, COUNTED, |m| forced(m, 8.0)) },
    small("a thousand times as stiff", &MATERIALS, ELASTIC, CLEAN, |m| stiff(m, 1e3)),
    small("E = 2e9 Pa", &["elastic", "neo_hookean", "plastic"], ELASTIC, CLEAN, |m| stiff(m, 2.5e4)),
    small("the paper's cube, the engine's steps", &["elastic", "foam"], ELASTIC, CLEAN, |m| paper(m, 128.0, 0.0)),
    small("the paper's cube, 1e-4 s forced", &["elastic"], ELASTIC, CLEAN, |m| paper(m, 128.0, 1e-4)),
    blown("the paper's cube, 2e-4 s forced", ANY, |m| paper(m, 128.0, 2e-4)),
    blown("the paper's cube, 2.8e-4 s forced", COUNTED, |m| paper(m, 128.0, 2.8e-4)),
    blown("the paper's cube, 4e-4 s forced as in the paper", COUNTED, |m| paper(m, 128.0, 4e-4)),
    small("200 cells a metre, 1e-4 s forced", &["elastic"], ELASTIC, ANY, |m| Setup {
        bound: Bound::SpeedLimit,
        ..paper(m, 200.0, 1e-4)
    }),
    small("200 cells a metre, the engine's steps", &["elastic"], ELASTIC, CLEAN, |m| paper(m, 200.0, 0.0)),
    small("honey on cells of 8 mm", &["liquid"], MPM, CLEAN, |_| honey(1.0)),
    small("honey, 8 times its step forced", &["liquid"], MPM, COUNTED, |_| honey(8.0)),
    small("snow hardened by exp(8)", &["snow"], MPM, ANY, |_| hardened()),
    small("stretched to twice its length", &["elastic", "neo_hookean"], MPM, FIRST, |m| {
        super::injected::stretched(m, 2.0)
    }),
    Case {
        name: "a million particles",
        solvers: MPM,
        materials: &["elastic"],
        large: true,
        repeats: false,
        expect: CLEAN,
        elsewhere: ANY,
        setup: million,
    },
];

/// 100 × 100 × 100 particles for a few steps.
fn million(material: Material) -> Setup {
    let lattice = Lattice::of_eight(1.0 / 128.0);
    let edge = 50.0 / 128.0;
    let cube = lattice.fill([0.0, 0.0, 0.002], [edge, edge, edge + 0.002], |_| true);
    let body = lattice.body(material, 1000.0, &cube, |_| [0.0, 0.0, -1.0]);
    let mut w = world(vec![body], lattice.dx, [-0.1, -0.1, -0.1], [0.5; 3]);
    w.gravity = [0.0, 0.0, -9.81];
    w.colliders = vec![ground(0.0, 0.2)];
    Setup { frames: 2, length: 4e-3, bound: Bound::Energy(1.05, 0.0), ..Setup::new(w) }
}

//! States no run should start from: NaN, infinity, F flat, inside out or huge.

use physvideo::scene::Material;
use physvideo::stages::mpm::FLOWS;
use physvideo_gpu::kernels::{Deformation, Particle};

use super::step::drop;
use super::{Bound, Case, MATERIALS, MPM, PARTICLES, Setup, Verdict};

const COUNTED: &[Verdict] = &[Verdict::Counted, Verdict::TakenBack];
/// A liquid squeezed to nothing asks for steps that are none.
const END: &[Verdict] = &[Verdict::Clean, Verdict::Counted, Verdict::TakenBack, Verdict::Refused];

/// The drop, spoilt. The energy at the start is what is spoilt: the bound is the speed limit's.
fn spoilt(material: Material, spoil: fn(&mut [Particle], &mut [Deformation])) -> Setup {
    Setup { spoil, bound: Bound::SpeedLimit, ..drop(material, 1000.0, 1.0) }
}

/// The drop in free space, stretched along x, without stress until the first step.
pub fn stretched(material: Material, times: f32) -> Setup {
    assert_eq!(times, 2.0, "written into the particles as it is");
    let mut s = drop(material, 1000.0, 0.0);
    // ½ (λ + 2μ) (2 − 1)² of 1/64 m³.
    s.bound = Bound::Energy(1.05, 950.0);
    s.spoil = |particles, deformations| {
        for (p, d) in particles.iter_mut().zip(deformations) {
            p.x = [2.0 * p.x[0], p.x[1], p.x[2] + 0.5];
            d.f0[0] = 2.0;
        }
    };
    s
}

fn not_finite(particles: &mut [Particle], deformations: &mut [Deformation]) {
    particles[10].x[0] = f32::NAN;
    particles[70].x[2] = f32::INFINITY;
    particles[130].v[1] = f32::NAN;
    particles[190].v[2] = f32::NEG_INFINITY;
    particles[250].c1[0] = f32::NAN;
    particles[310].s[0] = f32::INFINITY;
    deformations[370].f0[0] = f32::NAN;
    deformations[430].f0[0] = f32::INFINITY;
}

/// Every eighth particle gets F = diag(x, y, y); of a liquid J = x y².
fn diagonal<const X: i32, const Y: i32>(particles: &mut [Particle], deformations: &mut [Deformation]) {
    let (x, y) = (X as f32 * 1e-3, Y as f32 * 1e-3);
    for (p, d) in particles.iter().zip(deformations).step_by(8) {
        // Of a liquid the second column is empty.
        if p.tag & FLOWS != 0 && d.f1[1] == 0.0 {
            d.f0[0] = x * y * y;
        } else {
            (d.f0[0], d.f1[1], d.f2[2]) = (x, y, y);
        }
    }
}

fn huge(_: &mut [Particle], deformations: &mut [Deformation]) {
    deformations[100].f0[0] = 1e12;
}

const fn case(
    name: &'static str,
    materials: &'static [&'static str],
    expect: &'static [Verdict],
    setup: fn(Material) -> Setup,
) -> Case {
    Case { name, solvers: MPM, materials, large: false, repeats: true, expect, elsewhere: COUNTED, setup }
}

/// Those whose stress at F = 1e12 is still a number and whose waves grow with it.
const STIFFEN: [&str; 2] = ["elastic", "neo_hookean"];
const YIELD: [&str; 5] = ["plastic", "snow", "foam", "sand", "liquid"];

pub const CASES: [Case; 6] = [
    Case {
        solvers: PARTICLES,
        ..case("NaN and infinity in x, v, C, stress, F", &MATERIALS, COUNTED, |m| spoilt(m, not_finite))
    },
    case("F near 0", &MATERIALS, END, |m| spoilt(m, diagonal::<1, 1>)),
    case("F flat", &MATERIALS, END, |m| spoilt(m, diagonal::<1, 1000>)),
    case("F inside out", &MATERIALS, END, |m| spoilt(m, diagonal::<-1000, 1000>)),
    case("one F of 1e12", &STIFFEN, &[Verdict::Refused], |m| spoilt(m, huge)),
    case(
        "one F of 1e12, yielding",
        &YIELD,
        &[Verdict::Clean, Verdict::Counted, Verdict::TakenBack, Verdict::Refused],
        |m| spoilt(m, huge),
    ),
];

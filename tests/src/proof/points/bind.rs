//! Proof of `points/bind`: where particles are, and F⁻¹.

use glam::{DMat3, DVec3};
use physvideo_gpu::kernels::{Bound, Carried, Deformation, Particle};

use super::each;
use crate::proof::cloud::{Cloud, QUARANTINED};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "points/bind",
    inputs,
    compare,
    tolerance: 1e-6,
    reason: "cross products and a determinant of numbers near 1 in f32; relative to their sizes over the determinant",
    unordered: &[],
    bytes: 76.0 + 64.0,
    flops: 45.0,
};

/// One particle in eight is flattened.
fn inputs(ask: Ask) -> Call {
    let mut cloud = Cloud::new(ask).quarantined();
    for d in cloud.deformations.iter_mut().step_by(8) {
        d.f2 = [0.0; 4];
    }
    each(ask.items, ask)
        .immediates(&Carried { count: ask.items as u32 })
        .with("particles", &cloud.particles)
        .with("deformations", &cloud.deformations)
        .with("bound", &vec![Bound { x: [f32::NAN; 4], ..Default::default() }; ask.items])
}

/// F of a particle.
pub(super) fn gradient(d: &Deformation) -> DMat3 {
    let column = |f: [f32; 4]| DVec3::new(f[0].into(), f[1].into(), f[2].into());
    DMat3::from_cols(column(d.f0), column(d.f1), column(d.f2))
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let particles: Vec<Particle> = call.buffers.get("particles");
    let deformations: Vec<Deformation> = call.buffers.get("deformations");
    let bound: Vec<Bound> = out.get("bound");
    let (mut got, mut want, mut scale, mut stays) = (Vec::new(), Vec::new(), Vec::new(), true);
    for ((p, d), b) in particles.iter().zip(&deformations).zip(&bound) {
        if p.tag & QUARANTINED != 0 {
            continue; // carries nothing
        }
        stays &= b.x[..3] == p.x;
        let f = gradient(d);
        let flat = f.z_axis == DVec3::ZERO;
        let inverse = if flat { DMat3::IDENTITY } else { f.inverse() };
        let rows = inverse.transpose();
        let lengths = [f.x_axis, f.y_axis, f.z_axis].map(DVec3::length);
        let all: f64 = lengths.iter().product::<f64>() / f.determinant().abs();
        for (row, (i, length)) in
            [b.i0, b.i1, b.i2].iter().zip([rows.x_axis, rows.y_axis, rows.z_axis].iter().zip(lengths))
        {
            got.extend(row.map(f64::from));
            want.extend([i.x, i.y, i.z, 0.0]);
            scale.extend([if flat { 0.0 } else { all * all / length }; 4]);
        }
    }
    vec![Compared::fact("positions", stays), Compared::close("inverses", got, want, scale)]
}

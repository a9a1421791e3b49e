//! Proof of `lagrangian/sample`: x = X + Σ N u, v = Σ N v, F = I + Σ u ⊗ ∇N, C = (Σ v ⊗ ∇N) F⁻¹.

use bytemuck::Zeroable;
use physvideo_gpu::kernels::{Deformation, ElasticCell, Particle, Rest};

use super::{Bodies, NOBODY, at_point, quarter};
use crate::proof::mpm::{Mat3, affine, gradient, vec3};
use crate::proof::{Ask, Buffers, Call, Case, Compared};

pub static CASE: Case = Case {
    kernel: "lagrangian/sample",
    inputs,
    compare,
    tolerance: 3e-6,
    reason: "sums of 27 products in f32; C divides by J, of which its scale holds the inverse",
    unordered: &[],
    bytes: 220.0,
    flops: 500.0,
};

fn inputs(ask: Ask) -> Call {
    let mut b = Bodies::new(ask);
    if ask.poison && !b.u.is_empty() {
        b.u[0] = [f32::NAN; 4];
    }
    let unit = |a: usize, w: f32| std::array::from_fn(|i| if i == 3 { w } else { f32::from(u8::from(i == a)) });
    let deformation = Deformation { f0: unit(0, 3e-6), f1: unit(1, 0.0), f2: unit(2, 0.0) };
    let particles: Vec<Particle> =
        b.rests.iter().map(|r| Particle { x: r.x, tag: 5, m: 0.25, ..Particle::zeroed() }).collect();
    Call::new(b.rests.len().div_ceil(64))
        .immediates(&b.sizes)
        .with("cells", &b.cells)
        .with("u", &b.u)
        .with("v", &b.v)
        .with("rests", &b.rests)
        .with("deformations", &vec![deformation; particles.len()])
        .with("particles", &particles)
}

fn compare(call: &Call, out: &Buffers) -> Vec<Compared> {
    let input = &call.buffers;
    let (cells, rests): (Vec<ElasticCell>, Vec<Rest>) = (input.get("cells"), input.get("rests"));
    let (u, v): (Vec<[f32; 4]>, Vec<[f32; 4]>) = (input.get("u"), input.get("v"));
    let (was, now): (Vec<Particle>, Vec<Particle>) = (input.get("particles"), out.get("particles"));
    let (before, after): (Vec<Deformation>, Vec<Deformation>) = (input.get("deformations"), out.get("deformations"));
    let (mut got, mut want, mut scale, mut kept) = (Vec::new(), Vec::new(), Vec::new(), true);
    for (i, rest) in rests.iter().enumerate() {
        kept &= now[i].m == was[i].m && now[i].tag == was[i].tag && after[i].f0[3] == before[i].f0[3];
        if rest.point == NOBODY {
            kept &= now[i] == was[i] && after[i] == before[i];
            continue;
        }
        let (cell, place) = (&cells[(rest.point >> 3) as usize], quarter(rest.point & 7));
        let ((moved, slope), (speed, rate)) = (at_point(cell, &u, place), at_point(cell, &v, place));
        let f = Mat3::identity() + slope;
        if !f.iter().all(|c| c.is_finite()) {
            continue;
        }
        let inverse = f.try_inverse().unwrap_or_else(Mat3::zeros);
        let mut add = |g: &[f64], w: &[f64], size: f64| {
            got.extend(g);
            want.extend(w);
            scale.extend(std::iter::repeat_n(size, w.len()));
        };
        add(vec3(&now[i].x).as_slice(), (vec3(&rest.x) + moved).as_slice(), 1.0);
        add(vec3(&now[i].v).as_slice(), speed.as_slice(), 1.0);
        add(gradient(&after[i]).as_slice(), f.as_slice(), 2.0);
        let size = 200.0 * (1.0 + f.norm_squared() * inverse.norm());
        add(affine(&now[i]).as_slice(), (rate * inverse).as_slice(), size);
    }
    vec![
        Compared::close("place, velocity, F and C", got, want, scale),
        Compared::fact("mass, tag and volume stay, and so does what is held", kept),
    ]
}

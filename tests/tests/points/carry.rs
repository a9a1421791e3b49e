//! Points that follow their particles.

use glam::{DMat3, Mat3, Vec3};
use physvideo_gpu::kernels::{Bound, Carried, Carrier, Deformation, Particle, points};
use physvideo_gpu::{Constants, Gpu, Recording};
use physvideo_tests::twins::points as twin;

use super::{QUARANTINED, Random, SIZES, gpu, silent};

/// Runs `points/bind` on the first state and `points/carry` on the second.
fn carried(gpu: &Gpu, rest: &[[f32; 4]], carriers: &[Carrier], then: &[State], now: &[State]) -> Vec<[f32; 4]> {
    let bound = gpu.alloc::<Bound>("run", "bound", then.len() as u64).unwrap();
    let upload = |s: &[State]| {
        let particles: Vec<_> =
            s.iter().map(|s| Particle { x: s.x.into(), tag: s.tag, ..Default::default() }).collect();
        let column = |s: &State, i: usize| s.f.col(i).extend(1e-6).to_array();
        let f = s.iter().map(|s| Deformation { f0: column(s, 0), f1: column(s, 1), f2: column(s, 2) });
        let f: Vec<_> = f.collect();
        (gpu.upload("run", "particles", &particles).unwrap(), gpu.upload("run", "deformations", &f).unwrap())
    };
    let mut rec = Recording::new("bind");
    let (particles, deformations) = upload(then);
    let immediates = Carried { count: then.len() as u32 };
    rec.each(&points::Bind { particles, deformations, bound, immediates }, &Constants::none(), then.len() as u64);
    let (particles, deformations) = upload(now);
    let points = gpu.alloc("run", "points", rest.len() as u64).unwrap();
    let call = points::Carry {
        rest: gpu.upload("run", "rest", rest).unwrap(),
        carriers: gpu.upload("run", "carriers", carriers).unwrap(),
        particles,
        deformations,
        bound,
        points,
        immediates: Carried { count: rest.len() as u32 },
    };
    rec.each(&call, &Constants::none(), rest.len() as u64);
    gpu.run(&rec).unwrap();
    let mut out = gpu.read(points).unwrap();
    out.truncate(rest.len());
    out
}

#[derive(Clone, Copy)]
struct State {
    x: Vec3,
    f: Mat3,
    tag: u32,
}

#[test]
fn points_are_carried_by_their_particles() {
    let gpu = gpu(&[]);
    let turn = Mat3::from_axis_angle(Vec3::new(1.0, 2.0, -1.0).normalize(), 1.1);
    let shift = Vec3::new(0.3, -0.2, 0.7);
    for n in SIZES {
        let mut r = Random(n as u64);
        let squeezed =
            |r: &mut Random| Mat3::IDENTITY + Mat3::from_cols(r.vec(-0.3, 0.3), r.vec(-0.3, 0.3), r.vec(-0.3, 0.3));
        let then: Vec<_> = (0..100).map(|_| State { x: r.vec(-1.0, 1.0), f: squeezed(&mut r), tag: 0 }).collect();
        let rest: Vec<_> = (0..n).map(|_| r.vec(-1.0, 1.0).extend(0.01).to_array()).collect();
        let carriers: Vec<_> = (0..n)
            .map(|i| {
                let particle = [0; 4].map(|_: u32| r.below(100) as u32);
                // Every fourth point is carried by nothing.
                let weight = if i % 4 == 3 { [0.0; 4] } else { [0.7, r.float(0.0, 1.0), r.float(0.0, 1.0), 0.0] };
                Carrier { particle, weight }
            })
            .collect();
        // Nothing moved, whatever F is: not a bit changes beyond the rounding of F F⁻¹.
        for (a, b) in carried(&gpu, &rest, &carriers, &then, &then).iter().zip(&rest) {
            assert!((Vec3::from_slice(a) - Vec3::from_slice(b)).length() < 1e-6);
        }
        let straight: Vec<_> = then.iter().map(|s| State { f: Mat3::IDENTITY, ..*s }).collect();
        assert_eq!(carried(&gpu, &rest, &carriers, &straight, &straight), rest);
        // A rigid motion of all particles moves all points rigidly.
        let rigid: Vec<_> = then.iter().map(|s| State { x: turn * s.x + shift, f: turn * s.f, tag: 0 }).collect();
        for (i, p) in carried(&gpu, &rest, &carriers, &then, &rigid).iter().enumerate() {
            let x = Vec3::from_slice(&rest[i]);
            let wanted = if i % 4 == 3 { x } else { turn * x + shift };
            // Coordinates of up to 3 m through two products of 3 × 3 matrices in f32.
            assert!((Vec3::from_slice(p) - wanted).length() < 4e-6 && p[3] == 0.01, "point {i}: {p:?}, not {wanted}");
        }
        // Any motion: against the definition in f64.
        let bent: Vec<_> =
            then.iter().map(|s| State { x: s.x + r.vec(-0.2, 0.2), f: squeezed(&mut r), tag: 0 }).collect();
        for (i, p) in carried(&gpu, &rest, &carriers, &then, &bent).iter().enumerate().filter(|(i, _)| i % 4 != 3) {
            let by = (0..3).map(|k| {
                let id = carriers[i].particle[k] as usize;
                let [a, b] = [then[id], bent[id]];
                let wide = |m: Mat3| DMat3::from_cols_array(&m.to_cols_array().map(f64::from));
                let p = twin::Particle { x0: a.x.as_dvec3(), x: b.x.as_dvec3(), f0: wide(a.f), f: wide(b.f) };
                (p, f64::from(carriers[i].weight[k]))
            });
            let wanted = twin::carry(Vec3::from_slice(&rest[i]).as_dvec3(), &by.collect::<Vec<_>>());
            // As above; F up to 2, F⁻¹ up to about 10 here.
            assert!((Vec3::from_slice(p).as_dvec3() - wanted).length() < 2e-5, "point {i}: {p:?}, not {wanted}");
        }
    }
    silent(&gpu);
}

#[test]
fn quarantined_particles_carry_nothing() {
    let gpu = gpu(&[]);
    let at = |x: f32| State { x: Vec3::new(x, 0.0, 0.0), f: Mat3::IDENTITY, tag: 0 };
    let lost = State { x: Vec3::NAN, f: Mat3::NAN, tag: QUARANTINED | 3 };
    let carrier = Carrier { particle: [0, 1, 0, 0], weight: [0.5, 0.5, 0.0, 0.0] };
    let rest = [[0.5, 0.0, 0.0, 0.01]];
    let one = carried(&gpu, &rest, &[carrier], &[at(0.0), at(1.0)], &[lost, at(3.0)]);
    assert_eq!(one, [[2.5, 0.0, 0.0, 0.01]]);
    // With no carrier left the point is not drawn.
    let none = carried(&gpu, &rest, &[carrier], &[at(0.0), at(1.0)], &[lost, lost]);
    assert_eq!(none, [[0.5, 0.0, 0.0, 0.0]]);
    silent(&gpu);
}

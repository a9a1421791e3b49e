//! Proofs of `wgsl/mpm`, and the equations their twins share, in f64. Written from the equations, not from the WGSL.

pub mod clock;
pub mod force;
pub mod g2p;
pub mod grid;
pub mod grid_rows;
#[path = "material.rs"]
pub mod law;
pub mod measure;
pub mod obstacle;
pub mod p2g;
pub mod p2g_fixed;
pub mod p2g_float;
pub mod receive;
pub mod settle;
pub mod spline;
#[path = "stress.rs"]
pub mod stress_case;
pub mod survey;

use nalgebra::{Matrix3, Vector3};
use physvideo_gpu::kernels::family::material;
use physvideo_gpu::kernels::{Body, Deformation, MEMBERS, Particle};

/// A vector in f64.
pub type Vec3 = Vector3<f64>;
/// A matrix in f64.
pub type Mat3 = Matrix3<f64>;

/// The first three numbers of a vector of the device.
pub fn vec3(v: &[f32]) -> Vec3 {
    Vec3::new(v[0].into(), v[1].into(), v[2].into())
}

/// Affine velocity C of a particle.
pub fn affine(p: &Particle) -> Mat3 {
    Mat3::from_rows(&[vec3(&p.c0).transpose(), vec3(&p.c1).transpose(), vec3(&p.c2).transpose()])
}

/// V0 τ as a particle carries it [J].
pub fn stress(p: &Particle) -> Mat3 {
    symmetric([p.c0[3], p.c1[3], p.c2[3], p.s[0], p.s[1], p.s[2]].map(f64::from))
}

/// A symmetric matrix from xx, yy, zz, xy, xz, yz.
pub fn symmetric([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Mat3 {
    Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// Deformation gradient F.
pub fn gradient(d: &Deformation) -> Mat3 {
    Mat3::from_columns(&[vec3(&d.f0), vec3(&d.f1), vec3(&d.f2)])
}

/// Bodies of the proofs: one of each material, and one of a material there is not, whose weight is carried.
pub fn bodies() -> Vec<Body> {
    let materials = MEMBERS.iter().filter(|m| m.family == "material").map(|m| m.kind);
    let mut all: Vec<Body> = materials
        .zip(0u32..)
        .map(|(material, i)| {
            let (mu, lambda) = (900.0 - 200.0 * (i % 3) as f32, 1500.0 - 1100.0 * (i % 2) as f32);
            Body {
                material,
                fields: [0b1011, 0b1101][i as usize % 2] | 0xfff0,
                mu,
                lambda,
                p: own(material),
                gravity: [0.1 * i as f32, -0.2, -9.81],
                wave: 3.0 + i as f32,
            }
        })
        .collect();
    all.push(Body { material: u32::MAX, mu: 800.0, lambda: 800.0, wave: 2.0, ..Default::default() });
    all
}

/// Parameters of a material's own: some particles of the clouds yield by them, some do not.
fn own(kind: u32) -> [f32; 4] {
    match kind {
        material::PLASTIC => [300.0, 200.0, 0.0, 0.0],
        material::SNOW => [0.1, 0.05, 2.0, 0.6],
        material::SAND => [0.1, 0.0, 0.0, 0.0],
        material::LIQUID => [7.0, 0.3, 0.0, 0.0],
        _ => [0.0; 4],
    }
}

/// What a material of the device would be asked about a particle.
pub fn memory(d: &Deformation) -> f64 {
    f64::from(d.f1[3])
}

//! Proofs of `wgsl/sph`, and the equations their twins share, in f64. Written from the equations, not from the WGSL.

pub mod adopt;
pub mod advance;
pub mod clock;
pub mod cohesion;
pub mod density;
pub mod descend;
pub mod force;
pub mod judge;
pub mod pack;
pub mod press;
pub mod relax;
pub mod resist;
pub mod search;
pub mod source;
pub mod spread;
pub mod surround;
pub mod total;
pub mod wall;
pub mod weigh;

use nalgebra::Vector3;
use physvideo_gpu::kernels::{Clock, Counts, Crowd, Grid, Local};

use super::cloud::grid;
use super::{Ask, Call};
use crate::random::Random;

/// Vectors of the device, one a place.
pub type Vectors = Vec<[f32; 4]>;
/// A vector in f64.
pub type Vec3 = Vector3<f64>;

/// The first three numbers of a vector of the device.
pub fn vec3(v: &[f32]) -> Vec3 {
    Vec3::new(v[0].into(), v[1].into(), v[2].into())
}

/// Side of a cell of the sort [h].
pub const CELL: f64 = 2.2;

/// Smoothing length of the proofs' grid [m].
pub fn h() -> f64 {
    f64::from(grid().dx) / CELL
}

/// A place in one word: 1/256 of a cell, modulo 8 cells in x and y, 4 in z.
pub fn spot(x: Vec3) -> u32 {
    let g = grid();
    let q: [u32; 3] =
        std::array::from_fn(|a| ((x[a] - f64::from(g.origin[a])) / f64::from(g.dx) * 256.0).floor() as i64 as u32);
    ((q[0] % 2048) << 21) | ((q[1] % 2048) << 10) | (q[2] % 1024)
}

/// The cubic spline of Monaghan (1992), not normalised, and its derivative by q.
fn cubic(q: f64) -> (f64, f64) {
    if q < 1.0 {
        (1.0 - 1.5 * q * q + 0.75 * q.powi(3), -3.0 * q + 2.25 * q * q)
    } else if q < 2.0 {
        (0.25 * (2.0 - q).powi(3), -0.75 * (2.0 - q).powi(2))
    } else {
        (0.0, 0.0)
    }
}

/// Sum over a regular lattice with spacing 1 of some function of the distance.
fn lattice_sum(f: impl Fn(f64) -> f64) -> f64 {
    let around = || -2..=2i32;
    let all = around().flat_map(|x| around().flat_map(move |y| around().map(move |z| x * x + y * y + z * z)));
    all.map(|square| f(f64::from(square).sqrt())).sum()
}

/// V W(q): a regular lattice sums to 1.
pub fn weight(q: f64) -> f64 {
    cubic(q).0 / lattice_sum(|r| cubic(r).0)
}

/// h V ∂W/∂r (q).
pub fn slope(q: f64) -> f64 {
    cubic(q).1 / lattice_sum(|r| cubic(r).0)
}

/// h² V ∂²W/∂r² (q).
pub fn bend(q: f64) -> f64 {
    let cubic = if q < 1.0 { 1.5 * (2.0 - q) - 6.0 * (1.0 - q) } else { 1.5 * (2.0 - q).max(0.0) };
    cubic / lattice_sum(|r| self::cubic(r).0)
}

/// By how much a regular lattice's gradient of a linear field is too steep.
pub fn steep() -> f64 {
    -lattice_sum(|r| r * slope(r)) / 3.0
}

/// Sum over a regular lattice of x^a y^b / r^(a + b), times some function of the distance.
fn moment(a: i32, b: i32, f: impl Fn(f64) -> f64) -> f64 {
    let around = || (-2..=2i32).map(f64::from);
    let all = around().flat_map(|x| around().flat_map(move |y| around().map(move |z| [x, y, z])));
    let far = all.map(|p| (p, (p[0] * p[0] + p[1] * p[1] + p[2] * p[2]).sqrt())).filter(|(_, r)| *r > 0.0);
    far.map(|(p, r)| f(r) * p[0].powi(a) * p[1].powi(b) / r.powi(a + b)).sum()
}

/// Weight of viscosity along the line of centres, k (a + b a²) with a = 2 − q: over a lattice Σ w r² x⁴/r⁴ is three times
/// Σ w r² x²y²/r⁴, as where all directions are alike, and the latter is 2.
pub fn rub(q: f64) -> f64 {
    let part = |power: i32| {
        move |r: f64| {
            let a = (2.0 - r).max(0.0);
            r * r * a.powi(power)
        }
    };
    let skew = |power: i32| moment(4, 0, part(power)) - 3.0 * moment(2, 2, part(power));
    let b = -skew(1) / skew(2);
    let k = 2.0 / (moment(2, 2, part(1)) + b * moment(2, 2, part(2)));
    let a = (2.0 - q).max(0.0);
    k * (a + b * a * a)
}

/// Share of the fill's lattice sum in a layer one spacing away, and that of the shear along it.
pub fn sheared() -> f64 {
    let around = || (-2..=2i32).map(f64::from);
    let layer: Vec<_> = around().flat_map(|x| around().map(move |y| [x, y, (x * x + y * y + 1.0).sqrt()])).collect();
    let fill: f64 = layer.iter().map(|[_, _, r]| weight(*r)).sum();
    let shear: f64 = layer.iter().map(|[x, y, r]| rub(*r) * (x * y / r).powi(2) / 2.0).sum();
    shear / fill
}

/// V ∇W between a particle and a neighbour at distance d [1/m].
pub fn gradient(d: Vec3) -> Vec3 {
    let r = d.norm();
    d * (slope(r / h()) / h() / r)
}

/// Particles in the order of their cells with lists of their neighbours, at about the density at rest. The last few
/// places are beyond the cursor and hold NaN where the inputs are to be poisoned.
pub struct Liquid {
    pub random: Random,
    pub places: Vec<[f32; 4]>,
    pub lists: Vec<u32>,
    pub crowds: Vec<Crowd>,
    pub placed: usize,
    pub stride: usize,
}

impl Liquid {
    pub fn new(ask: Ask) -> Self {
        let mut random = Random::new(ask.seed ^ 0x11d);
        let n = ask.items;
        let placed = if ask.poison { n - n / 16 } else { n };
        let side = h() as f32 * (n as f32).cbrt();
        let places: Vec<[f32; 4]> = (0..n)
            .map(|i| {
                let x: [f32; 3] = std::array::from_fn(|_| 0.1 + random.range(0.0, side));
                let density = [1000.0, 400.0][random.below(2)];
                if i < placed { [x[0], x[1], x[2], density] } else { [f32::NAN; 4] }
            })
            .collect();
        let mut lists = vec![0; 64 * n];
        let mut crowds = vec![Crowd { slope: [f32::NAN; 3], fill: f32::NAN, ..Default::default() }; n];
        for i in 0..placed {
            let x = vec3(&places[i]);
            let mut near: Vec<usize> =
                (0..placed).filter(|j| *j != i && (x - vec3(&places[*j])).norm() < 2.0 * h()).collect();
            random.shuffle(&mut near);
            near.truncate(64);
            let mut padded = near.clone();
            padded.resize(near.len().next_multiple_of(4), i);
            for (k, j) in padded.iter().enumerate() {
                lists[(k / 4 * n + i) * 4 + k % 4] = *j as u32;
            }
            crowds[i] = Crowd {
                slope: random.vector(30.0),
                fill: random.range(0.3, 1.2),
                coupling: random.range(1.0, 20.0),
                count: near.len() as u32,
                ..Default::default()
            };
        }
        Self { random, places, lists, crowds, placed, stride: n }
    }

    /// A vector for each place, NaN beyond the cursor.
    pub fn vectors(&mut self, mut make: impl FnMut(&mut Random) -> [f32; 4]) -> Vec<[f32; 4]> {
        let (placed, random) = (self.placed, &mut self.random);
        (0..self.stride).map(|i| if i < placed { make(random) } else { [f32::NAN; 4] }).collect()
    }

    pub fn locals(&mut self) -> Vec<Local> {
        let (placed, random) = (self.placed, &mut self.random);
        let wet = |random: &mut Random| random.chance(0.4);
        (0..self.stride)
            .map(|i| {
                let wall = if wet(random) { random.vector(50.0) } else { [0.0; 3] };
                Local {
                    wall: if i < placed { wall } else { [f32::NAN; 3] },
                    drift: random.range(-5.0, 5.0),
                    drive: random.vector(10.0),
                    fill: random.range(0.5, 1.1),
                    slide: random.vector(1.0),
                    friction: if random.chance(0.5) { random.range(0.0, 0.5) } else { 0.0 },
                    response: random.range(0.5, 20.0),
                    drag: if random.chance(0.3) { random.range(0.0, 300.0) } else { 0.0 },
                    density: [1000.0, 400.0][random.below(2)],
                    squeeze: if random.chance(0.3) { random.vector(300.0) } else { [0.0; 3] },
                    power: random.range(-5.0, 5.0),
                    tag: random.below(3) as u32 | if random.chance(0.05) { super::cloud::PINNED } else { 0 },
                }
            })
            .collect()
    }

    /// Neighbours of a particle as its list has them.
    pub fn near(call: &Call, i: usize) -> Vec<usize> {
        let (crowds, lists): (Vec<Crowd>, Vec<u32>) = (call.buffers.get("crowds"), call.buffers.get("lists"));
        let n = crowds.len();
        (0..crowds[i].count as usize).map(|k| lists[(k / 4 * n + i) * 4 + k % 4] as usize).collect()
    }

    /// The call of a kernel over these, with what all of them bind.
    pub fn call(&self) -> Call {
        let counts = Counts { cursor: self.placed as u32, blocks: 4, ..Default::default() };
        let clock = Clock {
            particles: self.stride as u32,
            dt: 2e-3,
            frame_start: 0.75,
            t: 0.25,
            wave_speed: 18.0,
            particle_groups: [self.stride.div_ceil(64) as u32, 1, 1],
            ..Default::default()
        };
        Call::new(self.stride.div_ceil(64) + 1)
            .with("places", &self.places)
            .with("lists", &self.lists)
            .with("crowds", &self.crowds)
            .with("live", &[counts])
            .with("clock", &[clock])
            .grid(&Grid { capacity: 8, rows: 8, ..grid() })
    }
}

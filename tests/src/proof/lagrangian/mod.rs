//! Proofs of `wgsl/lagrangian`: bodies on grids of their own at random places, and the equations their twins share, in
//! f64. Nodes are at the middles of cells, points at their quarters, weights those of the B-spline by its definition.

pub mod advance;
pub mod bend;
pub mod contact;
pub mod core;
pub mod force;
pub mod meet;
pub mod point;
pub mod press;
pub mod sample;
pub mod surface;
pub mod thin;

use std::collections::BTreeMap;

use physvideo_gpu::kernels::{self, Body, ElasticCell, ElasticNode, Reference, Rest, Skin, Solid};

use super::Ask;
use super::mpm::{Mat3, Vec3, bodies, law, spline, vec3};
use crate::random::Random;

/// No node, no point.
pub const NOBODY: u32 = u32::MAX;
/// Does not move by itself.
pub const HELD: u32 = 0x4000_0000;
/// Cell size [m].
pub const DX: f64 = 0.04;
/// Fastest wave [m/s]: nodes move at up to 1 m/s, so that some of what closes is a shock.
pub const WAVE: f64 = 2.4;

type At = [i32; 3];

/// Bodies of random cells.
pub struct Bodies {
    /// Sizes of a call.
    pub sizes: Reference,
    /// Its cells.
    pub cells: Vec<ElasticCell>,
    /// Its nodes.
    pub nodes: Vec<ElasticNode>,
    /// Points at the surface.
    pub skins: Vec<Skin>,
    /// Particles: every point, and some that are held.
    pub rests: Vec<Rest>,
    /// Places of the cells, by their slots.
    pub cell_at: Vec<At>,
    /// Places of the nodes.
    pub node_at: Vec<At>,
    /// Displacement of the nodes [m].
    pub u: Vec<[f32; 4]>,
    /// Velocity of the nodes [m/s], in w the last step.
    pub v: Vec<[f32; 4]>,
}

/// What the bodies are made of: one of each material, and one of none.
pub fn solids() -> Vec<Solid> {
    let solid = |b: &Body| Solid {
        material: b.material,
        fields: b.fields,
        mu: b.mu,
        lambda: b.lambda,
        volume: (0.125 * DX.powi(3)) as f32,
        stiffness: 4e4,
        wave: WAVE as f32,
        density: 500.0,
        gravity: b.gravity,
        damping: if b.material == kernels::family::material::COROTATED { 3e-3 } else { 0.0 },
    };
    elastic().iter().map(solid).collect()
}

/// The same as the materials' energies know them.
pub fn elastic() -> Vec<Body> {
    let kinds = [kernels::family::material::COROTATED, kernels::family::material::NEO_HOOKEAN, u32::MAX];
    bodies().into_iter().filter(|b| kinds.contains(&b.material)).collect()
}

/// Speed that limits the step where waves have speed c: ω dt ≤ 2 (sqrt(1 + ζ²) − ζ) with ζ = (β + η/(ρ c²)) ω/2 and
/// ω = 2.2 c/dx; `thick` is η/(ρ dx), of the shock.
pub fn damped(solid: &Solid, c: f64, thick: f64) -> f64 {
    let zeta = 1.1 * f64::from(solid.damping) * c / DX + if thick > 0.0 { 1.1 * thick / c } else { 0.0 };
    c / ((1.0 + zeta * zeta).sqrt() - zeta)
}

/// Part of a closing speed above a quarter of the waves' [m/s].
pub fn hurry(closing: f64, waves: f64) -> f64 {
    (closing - 0.25 * waves).max(0.0)
}

/// Pressure of a compliant surface over its stiffness at a depth: d²/(2 w) with w = `soft`, d − w/2 from there on, and d⁵/f⁴
/// with f = `firm` [m]; and the same as an energy [m²].
pub fn give(d: f64, soft: f64, firm: f64) -> (f64, f64) {
    let (p, e) = if d < soft {
        (d * d / (2.0 * soft), d.powi(3) / (6.0 * soft))
    } else {
        // From w on a line, whose integral begins with the w²/6 of the parabola.
        (d - soft / 2.0, soft * soft / 6.0 + (d - soft) * soft / 2.0 + (d - soft).powi(2) / 2.0)
    };
    (p + d.powi(5) / firm.powi(4), e + d.powi(6) / firm.powi(4) / 6.0)
}

/// By how much more it pushes where it closes at a speed, for that of the waves (Hunt & Crossley).
pub fn rebound(closing: f64, waves: f64) -> f64 {
    1.0 + 0.3 * (closing / waves).clamp(-1.0, 1.0)
}

/// What a shock adds (von Neumann & Richtmyer): −J q F⁻ᵀ with q = 1.5 ρ/J w², w the part that counts of the speed at which
/// the cell's two sides come together; and the slope of q against the rate of that, over the density at rest [m/s].
pub fn shock(solid: &Solid, f: &Mat3, rate: &Mat3) -> (Mat3, f64) {
    let (c, j) = (cofactor(f), f.determinant().max(0.05));
    // |cof F| of a squeeze along one axis: the other two singular values' product.
    let wide = (c.norm_squared() - 2.0).max(1.0).sqrt();
    let w = hurry(-DX * c.dot(rate) / wide, f64::from(solid.wave));
    (-1.5 * f64::from(solid.density) / j * w * w * c, 3.0 * w * wide / j)
}

/// Pressure over λ that fixed-corotated bodies gain below a third of their volume, and its slope against J, reversed.
pub fn squash(j: f64) -> (f64, f64) {
    let at = |j: f64| (12.0 * (1.0 / (3.0 * j) - 2.0 + 3.0 * j), 12.0 * (1.0 / (3.0 * j * j) - 3.0));
    match j {
        _ if j > 1.0 / 3.0 => (0.0, 0.0),
        _ if j > 0.05 => at(j),
        // Below 0 the slope still counts for the step.
        _ => (at(0.05).0 + at(0.05).1 * (0.05 - j.max(0.0)), at(0.05).1),
    }
}

/// What damping adds to it, by its definition: F S, S = β (2μ Ė + λ tr Ė), Ė = (Fᵀ Ḟ + Ḟᵀ F)/2.
pub fn viscous(solid: &Solid, f: &Mat3, rate: &Mat3) -> Mat3 {
    let strain = 0.5 * (f.transpose() * rate + rate.transpose() * f);
    let s = 2.0 * f64::from(solid.mu) * strain + f64::from(solid.lambda) * strain.trace() * Mat3::identity();
    f64::from(solid.damping) * f * s
}

/// Moved by a step.
pub fn moved(at: At, by: At) -> At {
    std::array::from_fn(|a| at[a] + by[a])
}

/// The 27 steps around a place, x fastest.
pub fn around() -> Vec<At> {
    let line = -1..=1;
    line.clone().flat_map(|z| line.clone().flat_map(move |y| (-1..=1).map(move |x| [x, y, z]))).collect()
}

/// A point of a cell, in cells from its middle.
pub fn quarter(corner: u32) -> [f64; 3] {
    std::array::from_fn(|a| if corner >> a & 1 == 1 { 0.25 } else { -0.25 })
}

/// N of the node `steps` cells from the middle of a cell, at `place` cells from it.
pub fn weight(steps: At, place: [f64; 3]) -> f64 {
    (0..3).map(|a| spline::weight(place[a] - f64::from(steps[a]))).product()
}

/// ∇N of the same, a metre.
pub fn gradient(steps: At, place: [f64; 3]) -> Vec3 {
    Vec3::from_fn(|axis, _| {
        let of = |a: usize| {
            let x = place[a] - f64::from(steps[a]);
            if a == axis { spline::slope(x) } else { spline::weight(x) }
        };
        of(0) * of(1) * of(2) / DX
    })
}

/// First Piola–Kirchhoff stress of the materials: fixed-corotated (Stomakhin 2012) and neo-Hookean (Bonet & Wood), whose
/// factor of cof F goes on along its tangent below J = 0.05.
pub fn piola(solid: &Solid, f: &Mat3) -> Mat3 {
    let (mu, lambda) = (f64::from(solid.mu), f64::from(solid.lambda));
    let (c, j) = (cofactor(f), f.determinant());
    match solid.material {
        1 => 2.0 * mu * (f - law::rotation(f)) + lambda * (j - 1.0 - squash(j).0) * c,
        2 => {
            let k = j.max(0.05);
            let factor = (lambda * k.ln() - mu) / k + (lambda * (1.0 - k.ln()) + mu) / (k * k) * (j - k);
            mu * f + factor * c
        }
        _ => Mat3::zeros(),
    }
}

/// dJ/dF.
pub fn cofactor(f: &Mat3) -> Mat3 {
    let column = |i: usize| f.column(i).into_owned();
    Mat3::from_columns(&[column(1).cross(&column(2)), column(2).cross(&column(0)), column(0).cross(&column(1))])
}

impl Bodies {
    /// `ask.items` cells in a lump, each with some of its points.
    pub fn new(ask: Ask) -> Self {
        let mut random = Random::new(ask.seed ^ 0x7e11);
        // A box that they fill to a half, of other sides along each axis.
        let side = ((2 * ask.items) as f64).cbrt().ceil().max(1.0) as i32;
        let mut places: Vec<At> = (0..(side + 1) * side * (side + 2))
            .map(|i| [i % (side + 1), i / (side + 1) % side, i / ((side + 1) * side)])
            .collect();
        random.shuffle(&mut places);
        places.truncate(ask.items);
        places.sort_by_key(|p| [p[2], p[1], p[0]]);
        let mut node_at: Vec<At> = places.iter().flat_map(|c| around().into_iter().map(|s| moved(*c, s))).collect();
        node_at.sort_by_key(|p| [p[2], p[1], p[0]]);
        node_at.dedup();
        let number = |list: &[At]| -> BTreeMap<At, u32> { list.iter().zip(0..).map(|(p, i)| (*p, i)).collect() };
        let (cell_of, node_of) = (number(&places), number(&node_at));
        let kinds = solids().len();
        let row = |at: At, i: usize| moved(at, [-1, i as i32 % 3 - 1, i as i32 / 3 - 1]);
        let (mut cells, mut skins, mut rests) = (Vec::new(), Vec::new(), Vec::new());
        for (i, at) in places.iter().enumerate() {
            let points = 1 + random.below(255) as u32;
            let surface = if random.chance(0.6) { points & random.below(256) as u32 } else { 0 };
            let body = random.below(kinds) as u32;
            let rows = std::array::from_fn(|r| node_of[&row(*at, r)]);
            let first = skins.len() as u32;
            for corner in (0..8).filter(|c| surface >> c & 1 == 1) {
                let place = quarter(corner);
                let x = std::array::from_fn(|a| ((f64::from(at[a]) + place[a]) * DX) as f32);
                let normal = vec3(&random.vector(1.0)).normalize();
                skins.push(Skin {
                    x,
                    point: (i as u32) << 3 | corner,
                    normal: [normal[0] as f32, normal[1] as f32, normal[2] as f32],
                    tag: body | (1 + random.below(63) as u32) << 8,
                });
            }
            for corner in (0..8).filter(|c| points >> c & 1 == 1) {
                let place = quarter(corner);
                let x = std::array::from_fn(|a| ((f64::from(at[a]) + place[a]) * DX) as f32);
                let point = if random.chance(0.1) { NOBODY } else { (i as u32) << 3 | corner };
                rests.push(Rest { x, point });
            }
            let skin = if surface == 0 { NOBODY } else { first };
            cells.push(ElasticCell { rows, mask: points | surface << 8 | body << 16, skin, slot: i as u32 });
        }
        let mut nodes: Vec<ElasticNode> = node_at
            .iter()
            .map(|at| {
                let rows = std::array::from_fn(|r| {
                    let three = [0, 1, 2].map(|x| cell_of.get(&moved(row(*at, r), [x, 0, 0])).copied());
                    let first = three.iter().flatten().next().copied().unwrap_or(0);
                    (0..3).fold(first << 3, |word, x| word | u32::from(three[x].is_some()) << x)
                });
                ElasticNode {
                    x: at.map(|c| (f64::from(c) * DX) as f32),
                    tag: random.below(kinds) as u32,
                    m: random.range(5e-4, 2e-3),
                    mirror: NOBODY,
                    rows,
                    spare: 0,
                }
            })
            .collect();
        // Some behind a clamp, some of them the image of another.
        for i in 0..nodes.len() {
            if random.chance(0.1) {
                nodes[i].tag |= HELD;
                let image = random.below(nodes.len());
                if nodes[image].tag & HELD == 0 && nodes[image].mirror == NOBODY {
                    nodes[image].mirror = i as u32;
                }
            }
        }
        let mut vectors = |size: f32, w: f32| -> Vec<[f32; 4]> {
            let of = |_| {
                let [x, y, z] = random.vector(size);
                [x, y, z, w]
            };
            (0..nodes.len()).map(of).collect()
        };
        // Strains of some tenths.
        let u = vectors(0.25 * DX as f32, 0.0);
        let v = vectors(1.0, 1.3e-3);
        let sizes = Reference {
            dx: DX as f32,
            nodes: nodes.len() as u32,
            cells: cells.len() as u32,
            skins: skins.len() as u32,
            points: rests.len() as u32,
            thin: 0,
            touched: cells.iter().filter(|c| c.skin != NOBODY).count() as u32,
        };
        // Those at the surface come first; slots go on counting places.
        cells.sort_by_key(|c| c.skin == NOBODY);
        let mut number = vec![0; cells.len()];
        (0..).zip(&cells).for_each(|(i, c)| number[c.slot as usize] = i);
        let points = rests.iter_mut().map(|r: &mut Rest| &mut r.point).chain(skins.iter_mut().map(|s| &mut s.point));
        points.filter(|p| **p != NOBODY).for_each(|p| *p = number[(*p >> 3) as usize] << 3 | *p & 7);
        Self { sizes, cells, nodes, skins, rests, cell_at: places, node_at, u, v }
    }
}

/// A field of the nodes and its gradient at `place` cells from the middle of a cell.
pub fn at_point(cell: &ElasticCell, field: &[[f32; 4]], place: [f64; 3]) -> (Vec3, Mat3) {
    let (mut value, mut slope) = (Vec3::zeros(), Mat3::zeros());
    for (i, s) in around().iter().enumerate() {
        let node = vec3(&field[cell.rows[i / 3] as usize + i % 3]);
        value += weight(*s, place) * node;
        slope += node * gradient(*s, place).transpose();
    }
    (value, slope)
}

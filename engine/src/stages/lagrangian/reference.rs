//! Bodies on grids of their own at rest, ready for the kernels: nodes with lumped masses, cells, points at the surface.
//! All bodies' nodes and cells are numbered in one go. Opens no device.

use std::collections::HashMap;

use physvideo_gpu::kernels::{ElasticCell, ElasticNode, Place, Rest, Skin, Solid, family::material};

use super::clamp::{Points, Role, role};
use super::lattice::{At, Lattice, Numbered, Unfit, around, cell, moved, weight_at, weight3};
use super::thin::{self, Thin};
use crate::world::{Body, World};

/// No node, no point (`NOBODY` in WGSL).
pub(super) const NOBODY: u32 = u32::MAX;
/// A node that does not move by itself (`HELD` in WGSL).
const HELD: u32 = 0x4000_0000;
/// Pressure of contact for a depth of one cell, as a multiple of ρ c². An impact at v sinks in by v/c over this, in cells;
/// it adds at most twice this to the 3 c²/dx² of the fastest vibration of a filled lattice, of the 7.1 c²/dx² that a
/// Courant number of 0.75 stands.
pub(super) const CONTACT: f32 = 1.5;

/// Everything the kernels are told about the bodies.
#[derive(Default)]
pub(super) struct Reference {
    pub nodes: Vec<ElasticNode>,
    /// Lumped mass of each node without that of its mirror image [kg].
    pub masses: Vec<f64>,
    /// Velocities of the nodes at the start [m/s].
    pub velocities: Vec<[f32; 4]>,
    pub cells: Vec<ElasticCell>,
    /// How many of them, at the front, have points at the surface.
    pub touched: u32,
    /// What is thin, and integrated by more points.
    pub thin: Thin,
    pub skins: Vec<Skin>,
    pub solids: Vec<Solid>,
    /// One for each particle.
    pub rests: Vec<Rest>,
    /// Nodes of each body.
    pub ranges: Vec<std::ops::Range<usize>>,
    /// Points at the surface of each body.
    pub skin_ranges: Vec<std::ops::Range<usize>>,
    /// Mass that is held [kg], of each body.
    pub held: Vec<f64>,
}

/// Whether every body can be simulated on a grid of its own.
///
/// # Errors
/// The first that cannot, and why.
pub fn fit(world: &World) -> Result<(), (usize, Unfit)> {
    world.bodies.iter().enumerate().try_for_each(|(index, body)| fit_body(body, world.dx).map_err(|why| (index, why)))
}

/// Whether a body can be simulated on a grid of its own, of cells of `dx` [m].
///
/// # Errors
/// Why it cannot.
pub fn fit_body(body: &Body, dx: f32) -> Result<(), Unfit> {
    if body.recycle.is_some() || body.emission.is_some() {
        return Err(Unfit::Recycled);
    }
    let elastic = [material::COROTATED, material::NEO_HOOKEAN].contains(&body.material.law().material);
    if elastic { Lattice::of(body, dx).map(|_| ()) } else { Err(Unfit::Material) }
}

impl Reference {
    /// Builds the grids of the bodies that are its own; the others have neither nodes nor points.
    ///
    /// # Errors
    /// The first body that has none, and why.
    pub fn new(world: &World, own: &[bool]) -> Result<Self, (usize, Unfit)> {
        let mut all = Self::default();
        for (index, body) in world.bodies.iter().enumerate() {
            if own.get(index) != Some(&true) {
                all.skip(body);
                continue;
            }
            let lattice = Lattice::of(body, world.dx).map_err(|why| (index, why))?;
            all.add(body, index as u32, &lattice, world.gravity, world.dx);
        }
        all.touched_first();
        Ok(all)
    }

    /// Whether any node moves by the opposite of another.
    pub fn mirrored(&self) -> bool {
        self.nodes.iter().any(|n| n.mirror != NOBODY)
    }

    /// Moves the cells with points at the surface to the front; nodes go on counting them in the order of places.
    fn touched_first(&mut self) {
        let with_slot = (0..).zip(&self.cells).map(|(slot, c)| ElasticCell { slot, ..*c });
        let (touched, inside): (Vec<_>, Vec<_>) = with_slot.partition(|c| c.skin != NOBODY);
        self.touched = touched.len() as u32;
        self.cells = [touched, inside].concat();
        let mut place = vec![0; self.cells.len()];
        (0..).zip(&self.cells).for_each(|(i, c)| place[c.slot as usize] = i);
        let points = self.rests.iter_mut().map(|r| &mut r.point).chain(self.skins.iter_mut().map(|s| &mut s.point));
        self.thin.cells.iter_mut().for_each(|t| t.cell = place[t.cell as usize]);
        points.filter(|p| **p != NOBODY).for_each(|p| *p = place[(*p >> 3) as usize] << 3 | *p & 7);
    }

    /// A body that another solver moves.
    fn skip(&mut self, body: &Body) {
        self.solids.push(Solid::default());
        self.rests.extend(body.positions.iter().map(|x| Rest { x: *x, point: NOBODY }));
        self.held.push(0.0);
        self.ranges.push(self.nodes.len()..self.nodes.len());
        self.skin_ranges.push(self.skins.len()..self.skins.len());
    }

    fn add(&mut self, body: &Body, tag: u32, lattice: &Lattice, gravity: [f32; 3], dx: f32) {
        let constants = body.constants(gravity, dx);
        self.solids.push(Solid {
            material: constants.material,
            fields: constants.fields,
            mu: constants.mu,
            lambda: constants.lambda,
            volume: body.particle_volume,
            stiffness: CONTACT * (constants.lambda + 2.0 * constants.mu) / dx,
            wave: body.wave_speed(),
            damping: body.damping,
            gravity: constants.gravity,
            density: body.density,
        });
        let held = |i: usize| body.pinned.get(i) == Some(&true);
        let mut points: HashMap<At, Points> = HashMap::new();
        for (i, at) in lattice.at.iter().enumerate() {
            let (cell, corner) = cell(*at);
            let of = points.entry(cell).or_default();
            *if held(i) { &mut of.held } else { &mut of.free } |= 1 << corner;
        }
        let cells = Numbered::new(points.iter().filter(|(_, p)| p.free > 0).map(|(at, _)| *at));
        let nodes = Numbered::new(cells.list.iter().flat_map(|c| around().map(|s| moved(*c, s))));
        let (first_cell, first_node) = (self.cells.len() as u32, self.nodes.len() as u32);
        // Rows of three along x begin at −1; y is faster than z.
        let row = |at: At, i: usize| moved(at, [-1, i as i32 % 3 - 1, i as i32 / 3 - 1]);
        for at in &cells.list {
            let rows = std::array::from_fn(|i| nodes.of(row(*at, i)).unwrap_or(0) + first_node);
            let mask = u32::from(points[at].free) | tag << 16;
            self.cells.push(ElasticCell { rows, mask, skin: NOBODY, slot: 0 });
        }
        for at in &nodes.list {
            let rows = std::array::from_fn(|i| {
                let first = row(*at, i);
                let of = |x: i32| cells.of(moved(first, [x, 0, 0]));
                let there = (0..3).filter(|x| of(*x).is_some());
                let first = (0..3).find_map(of).unwrap_or(0) + first_cell;
                there.fold(first << 3, |word, x| word | 1 << x)
            });
            let x = lattice.middle(*at).map(|c| c as f32);
            self.nodes.push(ElasticNode { x, tag, m: 0.0, mirror: NOBODY, rows, spare: 0 });
        }
        let density = f64::from(body.density) * f64::from(body.particle_volume);
        let mut masses = vec![0.0; nodes.list.len()];
        let all: HashMap<At, usize> = lattice.at.iter().zip(0..).map(|(at, i)| (*at, i)).collect();
        for (number, at) in (first_cell..).zip(&cells.list) {
            let mut places = Vec::new();
            for corner in (0..8).filter(|c| points[at].free >> c & 1 == 1) {
                let axes = thin::axes(&all, std::array::from_fn(|a| 2 * at[a] + (corner >> a & 1) as i32));
                let own = thin::places(corner, axes);
                for s in around() {
                    let of = |p: &Place| f64::from(p.share) * weight_at(s, p.x.map(f64::from));
                    masses[nodes.of(moved(*at, s)).unwrap_or(0) as usize] += density * own.iter().map(of).sum::<f64>();
                }
                if axes != 0 {
                    self.cells[number as usize].mask &= !(1 << corner);
                    places.extend(own);
                }
            }
            self.thin.add(number, places);
        }
        let mut images = vec![None; nodes.list.len()];
        if body.pinned.contains(&true) {
            for (i, at) in nodes.list.iter().enumerate() {
                let node = first_node as usize + i;
                let role = role(&points, *at);
                if role == Role::Free {
                    continue;
                }
                self.nodes[node].tag |= HELD;
                let Role::Mirror(image) = role else { continue };
                // A node has one mirror image at most; one that another claimed before does not move.
                let Some(image) = nodes.of(image).map(|i| i as usize) else { continue };
                let free = &mut self.nodes[first_node as usize + image];
                if free.mirror == NOBODY {
                    free.mirror = node as u32;
                    images[i] = Some(image);
                }
            }
        }
        let own = masses.clone();
        images.iter().enumerate().filter_map(|(i, j)| j.map(|j| (i, j))).for_each(|(i, j)| masses[j] += own[i]);
        for (node, m) in self.nodes[first_node as usize..].iter_mut().zip(&masses) {
            node.m = *m as f32;
        }
        for (i, at) in lattice.at.iter().enumerate() {
            let (cell, corner) = cell(*at);
            let point = match cells.of(cell) {
                Some(number) if !held(i) => (first_cell + number) << 3 | corner,
                _ => NOBODY,
            };
            self.rests.push(Rest { x: body.positions[i], point });
        }
        self.held.push(density * body.pinned.iter().filter(|p| **p).count() as f64);
        self.ranges.push(first_node as usize..self.nodes.len());
        self.start(body, &lattice.at, &cells, &nodes, &own, &images);
        self.masses.extend(own);
        let first_skin = self.skins.len();
        self.skin(lattice, tag, first_cell, &cells, &all, held);
        self.skin_ranges.push(first_skin..self.skins.len());
    }

    /// Velocities of the nodes from those of the particles: the affine motion that fits best, exactly, and the rest of it
    /// by a projection with the lumped masses, repeated so that it approaches the consistent one.
    fn start(
        &mut self,
        body: &Body,
        places: &[At],
        cells: &Numbered,
        nodes: &Numbered,
        masses: &[f64],
        images: &[Option<usize>],
    ) {
        let first = self.velocities.len();
        self.velocities.resize(first + nodes.list.len(), [0.0; 4]);
        if body.velocities.iter().all(|v| *v == [0.0; 3]) {
            return;
        }
        let affine = Affine::fit(places, &body.velocities);
        let mut v: Vec<[f64; 3]> =
            nodes.list.iter().map(|at| affine.at(at.map(|c| 2.0 * f64::from(c) + 0.5))).collect();
        let hold = |v: &mut Vec<[f64; 3]>, tags: &[ElasticNode]| {
            for i in (0..v.len()).filter(|i| tags[*i].tag & HELD != 0) {
                v[i] = images[i].map_or([0.0; 3], |j| v[j].map(|c| -c));
            }
        };
        let density = f64::from(body.density) * f64::from(body.particle_volume);
        let of = |steps: At, at: At| nodes.of(moved(at, steps)).unwrap_or(0) as usize;
        for _ in 0..8 {
            hold(&mut v, &self.nodes[first..]);
            let mut change = vec![[0.0; 3]; v.len()];
            for (place, want) in places.iter().zip(&body.velocities) {
                let (at, corner) = cell(*place);
                if cells.of(at).is_none() {
                    continue;
                }
                let mut now = [0.0; 3];
                around().for_each(|s| (0..3).for_each(|a| now[a] += weight3(s, corner) * v[of(s, at)][a]));
                for s in around() {
                    let share = density * weight3(s, corner);
                    (0..3).for_each(|a| change[of(s, at)][a] += share * (f64::from(want[a]) - now[a]));
                }
            }
            for ((v, change), m) in v.iter_mut().zip(&change).zip(masses).filter(|(_, m)| **m > 0.0) {
                (0..3).for_each(|a| v[a] += change[a] / m);
            }
        }
        hold(&mut v, &self.nodes[first..]);
        for (to, v) in self.velocities[first..].iter_mut().zip(&v) {
            *to = [v[0] as f32, v[1] as f32, v[2] as f32, 0.0];
        }
    }

    /// The points at the surface: free ones that lack a neighbour along an axis. The normal is that of the missing faces
    /// within two spacings; a sheet one point thick has none.
    fn skin(
        &mut self,
        lattice: &Lattice,
        body: u32,
        first_cell: u32,
        cells: &Numbered,
        all: &HashMap<At, usize>,
        held: impl Fn(usize) -> bool,
    ) {
        let lacks = |at: At, axis: usize, way: i32| {
            let mut by = [0; 3];
            by[axis] = way;
            !all.contains_key(&moved(at, by))
        };
        let faces = |at: At| -> u32 {
            (0..3).map(|a| u32::from(lacks(at, a, -1)) << a | u32::from(lacks(at, a, 1)) << (3 + a)).sum()
        };
        for (number, place) in cells.list.iter().enumerate() {
            for corner in 0..8 {
                let at: At = std::array::from_fn(|a| 2 * place[a] + (corner >> a & 1));
                let missing = faces(at);
                if missing == 0 || all.get(&at).is_none_or(|i| held(*i)) {
                    continue;
                }
                let near = (0..125).map(|n| moved(at, [n % 5 - 2, n / 5 % 5 - 2, n / 25 - 2]));
                let smooth = near.filter(|at| all.contains_key(at)).map(faces).fold(glam::Vec3::ZERO, |sum, f| {
                    sum + glam::Vec3::from_array(std::array::from_fn(|a| {
                        (f >> (3 + a) & 1) as f32 - (f >> a & 1) as f32
                    }))
                });
                let cell = &mut self.cells[first_cell as usize + number];
                cell.skin = cell.skin.min(self.skins.len() as u32);
                cell.mask |= 1 << (8 + corner);
                self.skins.push(Skin {
                    x: std::array::from_fn(|a| (lattice.origin[a] + f64::from(at[a]) * lattice.spacing) as f32),
                    point: (first_cell + number as u32) << 3 | corner as u32,
                    normal: smooth.normalize_or_zero().to_array(),
                    tag: body | missing << 8,
                });
            }
        }
    }
}

/// v = a + B (X − X̄), fitted by least squares.
struct Affine {
    middle: [f64; 3],
    mean: [f64; 3],
    slope: glam::DMat3,
}

impl Affine {
    fn fit(places: &[At], velocities: &[[f32; 3]]) -> Self {
        let n = places.len().max(1) as f64;
        let middle = std::array::from_fn(|a| places.iter().map(|p| f64::from(p[a])).sum::<f64>() / n);
        let mean = std::array::from_fn(|a| velocities.iter().map(|v| f64::from(v[a])).sum::<f64>() / n);
        let (mut spread, mut product) = (glam::DMat3::ZERO, glam::DMat3::ZERO);
        for (p, v) in places.iter().zip(velocities) {
            let x = glam::DVec3::from_array(std::array::from_fn(|a| f64::from(p[a]) - middle[a]));
            let v = glam::DVec3::from_array(std::array::from_fn(|a| f64::from(v[a]) - mean[a]));
            for a in 0..3 {
                *spread.col_mut(a) += x * x[a];
                *product.col_mut(a) += v * x[a];
            }
        }
        // A flat body says nothing of what changes across it.
        let slope =
            if spread.determinant() > 1e-6 * n.powi(3) { product * spread.inverse() } else { glam::DMat3::ZERO };
        Self { middle, mean, slope }
    }

    fn at(&self, place: [f64; 3]) -> [f64; 3] {
        let x = glam::DVec3::from_array(std::array::from_fn(|a| place[a] - self.middle[a]));
        (self.slope * x + glam::DVec3::from_array(self.mean)).to_array()
    }
}

//! The surface with which bodies on grids of their own meet each other, at rest: faces of points without a neighbour,
//! with smooth normals, in groups of 64 that are close together. Opens no device.

use std::collections::{HashMap, HashSet};

use physvideo_gpu::kernels::{Facet, Surface};

use super::fill::Fill;
use super::lattice::{At, Lattice, Unfit, moved};
use super::reference::{NOBODY, Reference};
use crate::world::World;

/// Facets of a group (`FACETS` in WGSL).
pub(super) const GROUP: usize = 64;
/// A place of a group without a facet (`NO_FACET` in WGSL).
const NO_FACET: u32 = 0x8000_0000;
/// A facet with another on the other side of its point (`SHEET` in WGSL).
const SHEET: u32 = 0x800;
/// The facets of all bodies.
pub(super) struct Facets {
    pub list: Vec<Facet>,
    /// Those of each body, in whole groups.
    pub ranges: Vec<std::ops::Range<usize>>,
}

impl Facets {
    /// Of the bodies of a world that are its own, whose grids are in `reference`.
    ///
    /// # Errors
    /// The first body that has none, and why.
    pub fn new(world: &World, reference: &Reference, own: &[bool]) -> Result<Self, (usize, Unfit)> {
        let skin_of: HashMap<u32, u32> = reference.skins.iter().zip(0..).map(|(s, i)| (s.point, i)).collect();
        let mut all = Self { list: Vec::new(), ranges: Vec::new() };
        let mut rests = reference.rests.iter();
        for (index, body) in world.bodies.iter().enumerate() {
            let points: Vec<u32> = rests.by_ref().take(body.positions.len()).map(|r| r.point).collect();
            if own.get(index) != Some(&true) {
                all.ranges.push(all.list.len()..all.list.len());
                continue;
            }
            let lattice = Lattice::of(body, world.dx).map_err(|why| (index, why))?;
            let law = Facet {
                tag: index as u32,
                stiffness: reference.solids[index].stiffness,
                friction: body.friction,
                push: NOBODY,
                ..Default::default()
            };
            let first = all.list.len();
            let shell = Shell::new(&lattice.at);
            let fill = own.contains(&false).then(|| Fill::new(&lattice.at));
            let mut order: Vec<usize> =
                (0..lattice.at.len()).filter(|i| shell.0.contains_key(&lattice.at[*i])).collect();
            order.sort_unstable_by_key(|i| morton(lattice.at[*i]));
            for i in order {
                let at = lattice.at[i];
                for Face { axis, up, sheet, normal } in shell.faces(at) {
                    let mut x: [f64; 3] =
                        std::array::from_fn(|a| lattice.origin[a] + f64::from(at[a]) * lattice.spacing);
                    x[axis] += if up { 0.5 } else { -0.5 } * lattice.spacing;
                    all.list.push(Facet {
                        x: x.map(|c| c as f32),
                        point: points[i],
                        normal: normal.to_array(),
                        room: fill.as_ref().map_or(0.0, |f| f.room(at, axis, up)),
                        tag: law.tag | (axis as u32) << 8 | u32::from(up) << 10 | if sheet { SHEET } else { 0 },
                        push: skin_of.get(&points[i]).map_or(NOBODY, |skin| 4 * skin),
                        ..law
                    });
                }
            }
            let none = Facet { tag: law.tag | NO_FACET, point: NOBODY, ..law };
            all.list.resize(all.list.len().next_multiple_of(GROUP), none);
            all.ranges.push(first..all.list.len());
        }
        Ok(all)
    }

    /// Sizes of a call.
    pub fn sizes(&self, dx: f32) -> Surface {
        Surface { dx, facets: self.list.len() as u32 }
    }
}

/// A face of a point: its axis, whether it looks up along it, whether the other side lies bare too, and the normal of the
/// smooth surface.
struct Face {
    axis: usize,
    up: bool,
    sheet: bool,
    normal: glam::Vec3,
}

/// A step along an axis.
fn step(axis: usize, by: i32) -> At {
    std::array::from_fn(|a| if a == axis { by } else { 0 })
}

/// The particles at a body's surface, and which of their faces lie bare: bit `axis`, and three more for those that look up.
struct Shell(HashMap<At, u8>);

impl Shell {
    fn new(places: &[At]) -> Self {
        let all: HashSet<At> = places.iter().copied().collect();
        let bare = |at: At, axis: usize, by: i32| u8::from(!all.contains(&moved(at, step(axis, by))));
        let faces = |at: At| (0..3).map(|a| bare(at, a, -1) << a | bare(at, a, 1) << (3 + a)).sum::<u8>();
        Self(places.iter().map(|at| (*at, faces(*at))).filter(|(_, faces)| *faces > 0).collect())
    }

    /// Whether the particle at `at`, if there is one, has that face.
    fn bare(&self, at: At, axis: usize, up: bool) -> bool {
        self.0.get(&at).is_some_and(|faces| faces >> (axis + if up { 3 } else { 0 }) & 1 == 1)
    }

    /// Sum of the faces within two spacings, the nearer the more.
    fn smooth(&self, at: At) -> glam::Vec3 {
        let near = (0..125).map(|n: i32| [n % 5 - 2, n / 5 % 5 - 2, n / 25 - 2]);
        near.map(|s| {
            let faces = self.0.get(&moved(at, s)).copied().unwrap_or(0);
            let side = |bit: usize| f32::from(faces >> bit & 1);
            let tent = s.iter().map(|c| (3 - c.abs()) as f32).product::<f32>();
            tent * glam::Vec3::from_array(std::array::from_fn(|a| side(3 + a) - side(a)))
        })
        .sum()
    }

    /// Whether the faces around a face are as high all along `line`: for each of the five lines beside each other, those
    /// that are there within two spacings.
    fn level(&self, at: At, axis: usize, up: bool, line: usize) -> bool {
        let across = 3 - axis - line;
        let height = |x: i32, y: i32| {
            let column = moved(at, moved(step(line, x), step(across, y)));
            [0, 1, -1, 2, -2, 3, -3, 4, -4].into_iter().find(|h| self.bare(moved(column, step(axis, *h)), axis, up))
        };
        (-2..=2).all(|y| {
            let mut all = (-2..=2).filter_map(|x| height(x, y));
            let first = all.next();
            all.all(|h| Some(h) == first)
        })
    }

    /// The faces of the particle at `at`. Of a sheet one particle thick one side is met.
    fn faces(&self, at: At) -> Vec<Face> {
        let sides = (0..3).filter_map(|a| {
            let (up, down) = (self.bare(at, a, true), self.bare(at, a, false));
            (up || down).then_some((a, up, up && down))
        });
        let sides: Vec<_> = sides.collect();
        if sides.is_empty() {
            return Vec::new();
        }
        let smooth = self.smooth(at);
        let face = |(axis, up, sheet): (usize, bool, bool)| {
            // What is flat is so up to its edges, where the sum over what is around is not.
            let flat = |line: usize| line != axis && self.level(at, axis, up, line);
            let mut normal = glam::Vec3::from_array(std::array::from_fn(|a| if flat(a) { 0.0 } else { smooth[a] }));
            let out = if up { 1.0 } else { -1.0 };
            if normal[axis] * out <= 0.0 {
                normal = glam::Vec3::from_array(std::array::from_fn(|a| if a == axis { out } else { 0.0 }));
            }
            Face { axis, up, sheet, normal: normal.normalize() }
        };
        sides.into_iter().map(face).collect()
    }
}

/// Bits of a place's indices in turns: close numbers are close places.
fn morton(at: At) -> u64 {
    let spread = |c: i32| (0..21).map(|bit| (c as u64 >> bit & 1) << (3 * bit)).sum::<u64>();
    spread(at[0]) | spread(at[1]) << 1 | spread(at[2]) << 2
}

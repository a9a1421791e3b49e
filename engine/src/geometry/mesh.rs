//! Closed triangle meshes and what of each vertical lattice column is inside them. Must not know files or particles.

use std::collections::{BTreeMap, HashMap};

use super::error::GeometryError;

/// A closed triangle mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct TriangleMesh {
    vertices: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Every edge is walked as often one way as the other, so that winding numbers mean something.
    oriented: bool,
}

/// The piece of a lattice column that is inside: z from `low` to `high` [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Span {
    pub column: [i32; 2],
    pub low: f64,
    pub high: f64,
}

impl TriangleMesh {
    /// Checks a mesh: vertices [m], triangles as indices from 0. Vertices at one place are one vertex, because OBJ
    /// files split them along seams of texture and normals.
    ///
    /// # Errors
    /// [`GeometryError::BadVertex`], [`GeometryError::BadIndex`], [`GeometryError::OpenMesh`].
    pub fn new(vertices: &[[f32; 3]], triangles: &[[u32; 3]]) -> Result<Self, GeometryError> {
        let mut place = HashMap::new();
        let mut weld = Vec::with_capacity(vertices.len());
        for (i, v) in vertices.iter().enumerate() {
            if !v.iter().all(|c| c.is_finite()) {
                return Err(GeometryError::BadVertex { vertex: i });
            }
            // Adding 0 makes -0 and 0 one place.
            weld.push(*place.entry(v.map(|c| (c + 0.0).to_bits())).or_insert(i as u32));
        }
        let mut welded = Vec::with_capacity(triangles.len());
        for (i, t) in triangles.iter().enumerate() {
            if let Some(&vertex) = t.iter().find(|&&v| v as usize >= vertices.len()) {
                return Err(GeometryError::BadIndex { triangle: i, vertex, vertices: vertices.len() });
            }
            let t = t.map(|v| weld[v as usize]);
            if t[0] != t[1] && t[1] != t[2] && t[2] != t[0] {
                welded.push(t);
            }
        }
        // Uses of each edge: in all, and forwards minus backwards. Ordered, so that the same edge is always named.
        let mut edges: BTreeMap<(u32, u32), (usize, i64)> = BTreeMap::new();
        for t in &welded {
            for (a, b) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                let edge = edges.entry((a.min(b), a.max(b))).or_default();
                edge.0 += 1;
                edge.1 += if a < b { 1 } else { -1 };
            }
        }
        if let Some((&(a, b), &(count, _))) = edges.iter().find(|e| e.1.0 % 2 == 1) {
            let (a_at, b_at) = (vertices[a as usize], vertices[b as usize]);
            return Err(GeometryError::OpenMesh { a, b, a_at, b_at, count });
        }
        let oriented = edges.values().all(|e| e.1 == 0);
        Ok(Self { vertices: vertices.to_vec(), triangles: welded, oriented })
    }

    /// Volume [m³]; of a mesh whose faces are turned inconsistently the volume of its bounding box.
    pub fn volume(&self) -> f64 {
        if !self.oriented {
            let (min, max) = self.bounds();
            return (0..3).map(|a| f64::from(max[a]) - f64::from(min[a])).product::<f64>().max(0.0);
        }
        let signed: f64 = self
            .triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|v| glam::DVec3::from(self.vertices[v as usize].map(f64::from)));
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        signed.abs()
    }

    /// Smallest side of the bounding box [m]; 0 without triangles.
    pub(super) fn extent(&self) -> f32 {
        let (min, max) = self.bounds();
        (0..3).map(|a| max[a] - min[a]).fold(f32::INFINITY, f32::min).max(0.0)
    }

    fn bounds(&self) -> ([f32; 3], [f32; 3]) {
        let mut bounds = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for v in self.triangles.iter().flatten().map(|&v| self.vertices[v as usize]) {
            for (a, c) in v.into_iter().enumerate() {
                bounds.0[a] = bounds.0[a].min(c);
                bounds.1[a] = bounds.1[a].max(c);
            }
        }
        bounds
    }

    /// What of the columns through ((i + ½) · spacing, (j + ½) · spacing) is inside, ordered by column and height.
    ///
    /// Inside is where the winding number is not zero (overlapping closed parts are one body); for faces turned
    /// inconsistently, where the number of faces above is odd. A column through an edge or a vertex crosses exactly
    /// one of the triangles that meet there on each side: edges are tested from the same end with the same
    /// arithmetic for both their triangles, and a tie goes to one of them by the edge's direction.
    pub(super) fn spans(&self, spacing: f32) -> Vec<Span> {
        let mut crossings: Vec<([i32; 2], f64, i32)> = Vec::new();
        for t in &self.triangles {
            self.cross(*t, spacing, &mut crossings);
        }
        crossings.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut spans = Vec::new();
        for column in crossings.chunk_by(|a, b| a.0 == b.0) {
            let mut winding = 0;
            for pair in column.windows(2) {
                winding = if self.oriented { winding + pair[0].2 } else { 1 - winding };
                if winding != 0 {
                    spans.push(Span { column: pair[0].0, low: pair[0].1, high: pair[1].1 });
                }
            }
        }
        spans
    }

    /// Adds the columns that cross one triangle: column, height and whether the face looks down (+1) or up (−1).
    fn cross(&self, t: [u32; 3], spacing: f32, crossings: &mut Vec<([i32; 2], f64, i32)>) {
        let at = |v: u32| self.vertices[v as usize].map(f64::from);
        let area = self.side(t[0], t[1], [at(t[2])[0], at(t[2])[1]]);
        if area == 0.0 {
            return;
        }
        // Counter-clockwise as seen from above; the normal of such a face points up.
        let (t, sign) = if area > 0.0 { (t, -1) } else { ([t[0], t[2], t[1]], 1) };
        let corners = t.map(at);
        let range = |a: usize| {
            let (low, high) =
                corners.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |m, c| (m.0.min(c[a]), m.1.max(c[a])));
            let index = |x: f64| x / f64::from(spacing) - 0.5;
            (index(low).floor() as i32)..(index(high).ceil() as i32).saturating_add(1)
        };
        for j in range(1) {
            for i in range(0) {
                // Rounded to f32, as the vertices are, which makes the products below all but exact.
                let p = [i, j].map(|c| f64::from(((f64::from(c) + 0.5) * f64::from(spacing)) as f32));
                let sides = [(1, 2), (2, 0), (0, 1)].map(|(a, b)| (self.side(t[a], t[b], p), corners[a], corners[b]));
                let inside = sides
                    .iter()
                    .all(|&(s, a, b)| s > 0.0 || (s == 0.0 && (b[1] < a[1] || (b[1] == a[1] && b[0] > a[0]))));
                if inside {
                    let weight: f64 = sides.iter().map(|s| s.0).sum();
                    let z = (0..3).map(|c| sides[c].0 * corners[c][2]).sum::<f64>() / weight;
                    crossings.push(([i, j], z, sign));
                }
            }
        }
    }

    /// Twice the signed area of (a, b, p) seen from above. Walks the edge from its lower index: the same bits with
    /// opposite sign for (b, a).
    fn side(&self, a: u32, b: u32, p: [f64; 2]) -> f64 {
        let (low, high) = (self.vertices[a.min(b) as usize], self.vertices[a.max(b) as usize]);
        let [lx, ly] = [f64::from(low[0]), f64::from(low[1])];
        let [hx, hy] = [f64::from(high[0]), f64::from(high[1])];
        let area = (hx - lx) * (p[1] - ly) - (hy - ly) * (p[0] - lx);
        if a < b { area } else { -area }
    }
}

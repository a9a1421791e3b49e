//! Closed volumes filled with particles on a world-aligned lattice. Must not know materials or how counts are limited.

use std::collections::HashSet;

use glam::{DVec3, Vec3};

use super::error::{GeometryError, positive};
use super::ground::WorldFromCamera;
use super::mesh::TriangleMesh;
use super::surface::SurfaceMap;

/// Particles of one body.
#[derive(Debug, Clone, PartialEq)]
pub struct Particles {
    /// World positions [m], in lattice order (z slowest, x fastest).
    pub positions: Vec<[f32; 3]>,
    /// Volume of each [m³]: spacing³.
    pub volume: f32,
    /// sRGB-encoded colour, 0–1.
    pub colors: Vec<[f32; 3]>,
}

/// The lattice of points (k + ½) · spacing in world space. Bodies that share it never overlap by rounding.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lattice {
    /// Distance between neighbours [m].
    pub spacing: f32,
}

/// A body seen as the pixels of one label: from the front surface back along the view rays.
#[derive(Debug, Clone, Copy)]
pub struct MaskBody<'a> {
    map: &'a SurfaceMap,
    label: u8,
    thickness: &'a [f32],
    rgb: &'a [[u8; 3]],
    world: &'a WorldFromCamera,
}

/// A lattice index and the colour found there.
type Site = ([i32; 3], [f32; 3]);

impl Lattice {
    /// `per_cell` = n³ particles in each grid cell of size `dx` [m].
    ///
    /// # Errors
    /// [`GeometryError::NotPositive`], [`GeometryError::NotACube`].
    pub fn new(dx: f32, per_cell: u32) -> Result<Self, GeometryError> {
        positive("the grid cell size", f64::from(dx))?;
        let n = (1..=64_u32).find(|n| n.pow(3) == per_cell).ok_or(GeometryError::NotACube(per_cell))?;
        Ok(Self { spacing: dx / n as f32 })
    }

    /// How many particles a body of `volume` [m³] will have, to about the lattice points at its surface. For
    /// refusing what cannot be stored before it is allocated.
    pub fn predict_count(&self, volume: f64) -> u64 {
        // `as` saturates, so that an infinite volume is u64::MAX.
        (volume / f64::from(self.spacing).powi(3)).round() as u64
    }

    /// Fills the middle of a box [m] with as many whole layers as fit, for a liquid whose images in walls at the faces must
    /// not come nearer to its particles than these are to each other.
    ///
    /// # Errors
    /// As [`Lattice::fill_box`].
    pub fn fill_vessel(
        &self,
        object: &str,
        min: [f32; 3],
        max: [f32; 3],
        color: [f32; 3],
    ) -> Result<Particles, GeometryError> {
        let size = self.layers(min, max).map(|n| n * self.spacing);
        self.seated(min, max, |_| self.fill_box(object, [0.0; 3], size, color))
    }

    /// What `fill` makes of a shape within a box [m] that it is told to move back by so much, moved there again: so the
    /// lattice has as many whole layers as fit in the middle of the box, as [`Lattice::fill_vessel`] has.
    ///
    /// # Errors
    /// Those of `fill`.
    pub fn seated(
        &self,
        min: [f32; 3],
        max: [f32; 3],
        fill: impl FnOnce(Vec3) -> Result<Particles, GeometryError>,
    ) -> Result<Particles, GeometryError> {
        let layers = self.layers(min, max);
        let corner: [f32; 3] = std::array::from_fn(|a| 0.5 * (min[a] + max[a] - layers[a] * self.spacing));
        let mut filled = fill(corner.into())?;
        filled.positions.iter_mut().for_each(|x| *x = std::array::from_fn(|a| x[a] + corner[a]));
        Ok(filled)
    }

    /// Whole layers that fit in a box [m]; a hundredth of one is rounding of what was meant to fit.
    fn layers(&self, min: [f32; 3], max: [f32; 3]) -> [f32; 3] {
        std::array::from_fn(|a| ((max[a] - min[a]) / self.spacing + 1e-2).floor().max(1.0))
    }

    /// Fills the half-open box [min, max) [m]. A box thinner than the spacing keeps one layer: the one nearest to
    /// its middle.
    ///
    /// # Errors
    /// [`GeometryError::NoParticles`] when `max` is not above `min`.
    pub fn fill_box(
        &self,
        object: &str,
        min: [f32; 3],
        max: [f32; 3],
        color: [f32; 3],
    ) -> Result<Particles, GeometryError> {
        let extent = (0..3).map(|a| max[a] - min[a]).fold(f32::INFINITY, f32::min);
        let mut sites = Vec::new();
        if extent > 0.0 {
            let range = [0, 1, 2].map(|a| {
                let (low, high) = (self.first_at(f64::from(min[a])), self.first_at(f64::from(max[a])));
                let middle = (0.5 * (f64::from(min[a]) + f64::from(max[a])) / f64::from(self.spacing)).floor() as i32;
                if high > low { low..high } else { middle..middle.saturating_add(1) }
            });
            for z in range[2].clone() {
                for y in range[1].clone() {
                    sites.extend(range[0].clone().map(|x| ([x, y, z], color)));
                }
            }
        }
        self.particles(object, f64::from(extent), sites)
    }

    /// Fills a ball [m].
    ///
    /// # Errors
    /// [`GeometryError::NoParticles`] when no lattice point is inside.
    pub fn fill_ball(
        &self,
        object: &str,
        center: [f32; 3],
        radius: f32,
        color: [f32; 3],
    ) -> Result<Particles, GeometryError> {
        let c = DVec3::from(center.map(f64::from));
        let r = f64::from(radius);
        let mut sites = Vec::new();
        for z in self.first_at(c.z - r)..self.first_at(c.z + r) {
            for y in self.first_at(c.y - r)..self.first_at(c.y + r) {
                let (dz, dy) = (self.at(z) - c.z, self.at(y) - c.y);
                let half = (r * r - dz * dz - dy * dy).max(0.0).sqrt();
                sites.extend((self.first_at(c.x - half)..self.first_at(c.x + half)).map(|x| ([x, y, z], color)));
            }
        }
        self.particles(object, 2.0 * r, sites)
    }

    /// Fills a closed mesh. A mesh so thin that no lattice point is inside keeps the points nearest to it, one for
    /// each column that passes through it.
    ///
    /// # Errors
    /// [`GeometryError::NoParticles`].
    pub fn fill_mesh(&self, object: &str, mesh: &TriangleMesh, color: [f32; 3]) -> Result<Particles, GeometryError> {
        let spans = mesh.spans(self.spacing);
        let mut sites = Vec::new();
        for span in &spans {
            let (low, high) = (self.first_at(span.low), self.first_at(span.high));
            sites.extend((low..high).map(|z| ([span.column[0], span.column[1], z], color)));
        }
        if sites.is_empty() {
            sites = spans
                .iter()
                .map(|s| {
                    let z = (0.5 * (s.low + s.high) / f64::from(self.spacing)).floor() as i32;
                    ([s.column[0], s.column[1], z], color)
                })
                .collect();
        }
        self.particles(object, f64::from(mesh.extent()), sites)
    }

    /// Fills the body behind a mask: a lattice point is inside when it is seen in a pixel of the mask, at or behind
    /// the front surface and less than the thickness behind it.
    ///
    /// Where the body is thinner than one lattice layer, it is taken as one layer thick, so that it does not
    /// vanish or fall apart; on surfaces seen at a grazing angle the layer is cut at four spacings along the ray.
    ///
    /// Whiskers are left out: strands one point wide, as at the tips of leaves. They have no shape to keep, and no
    /// step is safe for particles so nearly alone (Bai & Schroeder 2022).
    ///
    /// # Errors
    /// [`GeometryError::NoParticles`] when the mask is seen through no lattice point.
    pub fn fill_mask(&self, object: &str, body: &MaskBody) -> Result<Particles, GeometryError> {
        let thick = body.at_least_one_layer(self.spacing);
        let mut sites = Vec::new();
        for k in body.pixels() {
            self.fill_pixel(body, &thick, k, &mut sites);
        }
        let extent = body.pixels().map(|k| body.thickness[k]).fold(0.0, f32::max);
        self.particles(object, f64::from(extent), shave(sites))
    }

    /// The lattice points of the frustum behind pixel `k`: each layer of the lattice that the ray crosses is
    /// searched around the crossing.
    fn fill_pixel(&self, body: &MaskBody, thick: &[f32], k: usize, sites: &mut Vec<Site>) {
        let map = body.map;
        let [u, v] = map.pixel_center(k);
        // Just inside the corners, so that all are sampled as this pixel.
        let corners = [(-0.499, -0.499), (0.499, -0.499), (-0.499, 0.499), (0.499, 0.499)];
        let (mut near, mut far) = (f32::INFINITY, 0.0_f32);
        for (du, dv) in corners {
            let z = map.sample(&map.depth, [u + du, v + dv]).unwrap_or(map.depth[k]);
            let t = map.sample(thick, [u + du, v + dv]).unwrap_or(thick[k]);
            near = near.min(z);
            far = far.max(z + t);
        }
        let ray = map.camera.unproject([u, v], 1.0);
        let direction = (body.world.rotation * ray).as_dvec3();
        let eye = body.world.translation.as_dvec3();
        let (axis, along) =
            (0..3).map(|a| (a, direction[a])).fold((0, 0.0_f64), |m, c| if c.1.abs() > m.1.abs() { c } else { m });
        let footprint = f64::from(far / map.camera.focal_px) * (1.0 + direction.length() / along.abs());
        let ends = [f64::from(near), f64::from(far)].map(|z| eye[axis] + z * along);
        let (b, c) = ((axis + 1) % 3, (axis + 2) % 3);
        let color = body.rgb[k].map(|c| f32::from(c) / 255.0);
        for layer in self.around(ends[0].min(ends[1]), ends[0].max(ends[1]), footprint) {
            let crossing = eye + direction * ((self.at(layer) - eye[axis]) / along);
            for ib in self.around(crossing[b], crossing[b], footprint) {
                for ic in self.around(crossing[c], crossing[c], footprint) {
                    let mut site = [layer; 3];
                    site[b] = ib;
                    site[c] = ic;
                    if body.contains(thick, k, self.point(site)) {
                        sites.push((site, color));
                    }
                }
            }
        }
    }

    /// First index whose coordinate is at or above `x`.
    fn first_at(&self, x: f64) -> i32 {
        (x / f64::from(self.spacing) - 0.5).ceil() as i32
    }

    fn around(&self, low: f64, high: f64, slack: f64) -> std::ops::Range<i32> {
        self.first_at(low - slack)..self.first_at(high + slack)
    }

    fn at(&self, index: i32) -> f64 {
        (f64::from(index) + 0.5) * f64::from(self.spacing)
    }

    fn point(&self, site: [i32; 3]) -> Vec3 {
        DVec3::from(site.map(|i| self.at(i))).as_vec3()
    }

    fn particles(&self, object: &str, extent: f64, mut sites: Vec<Site>) -> Result<Particles, GeometryError> {
        if sites.is_empty() {
            return Err(GeometryError::NoParticles { object: object.to_owned(), extent, spacing: self.spacing });
        }
        sites.sort_by_key(|(s, _)| [s[2], s[1], s[0]]);
        Ok(Particles {
            positions: sites.iter().map(|s| self.point(s.0).to_array()).collect(),
            volume: self.spacing.powi(3),
            colors: sites.iter().map(|s| s.1).collect(),
        })
    }
}

/// Sites without those that have fewer than three neighbours among the 26 around them, until there are none; all of
/// them where nothing else would be left.
fn shave(sites: Vec<Site>) -> Vec<Site> {
    let mut kept: HashSet<[i32; 3]> = sites.iter().map(|s| s.0).collect();
    let crowded = |kept: &HashSet<[i32; 3]>, s: &[i32; 3]| {
        let around = (0..27).map(|n| [s[0] + n % 3 - 1, s[1] + n / 3 % 3 - 1, s[2] + n / 9 - 1]);
        around.filter(|o| kept.contains(o)).count() > 3 // the site itself is among them
    };
    loop {
        let thin: Vec<_> = kept.iter().filter(|s| !crowded(&kept, s)).copied().collect();
        if thin.is_empty() {
            break;
        }
        thin.iter().for_each(|s| _ = kept.remove(s));
    }
    if kept.is_empty() {
        return sites;
    }
    sites.into_iter().filter(|s| kept.contains(&s.0)).collect()
}

impl<'a> MaskBody<'a> {
    /// The body of `label`, with the thickness along the view ray [m] from [`super::thickness`] and the encoded
    /// colours of the photograph, both per pixel.
    ///
    /// # Errors
    /// [`GeometryError::EmptyMask`], [`GeometryError::SizeMismatch`].
    pub fn new(
        map: &'a SurfaceMap,
        label: u8,
        thickness: &'a [f32],
        rgb: &'a [[u8; 3]],
        world: &'a WorldFromCamera,
    ) -> Result<Self, GeometryError> {
        for (what, got) in [("the thickness", thickness.len()), ("the image", rgb.len())] {
            if got != map.labels.len() {
                return Err(GeometryError::SizeMismatch { what, width: map.width, height: map.height, got });
            }
        }
        let body = Self { map, label, thickness, rgb, world };
        if body.pixels().next().is_none() { Err(GeometryError::EmptyMask { label }) } else { Ok(body) }
    }

    /// Volume [m³] of the body, for [`Lattice::predict_count`]. Sums pixel footprint × thickness along the ray.
    pub fn volume(&self) -> f64 {
        self.pixels()
            .map(|k| {
                let front = f64::from(self.map.depth[k]);
                let stretch = f64::from(self.map.camera.stretch(self.map.pixel_center(k)));
                let back = front + f64::from(self.thickness[k]) / stretch;
                (back.powi(3) - front.powi(3)) / 3.0 / f64::from(self.map.camera.focal_px).powi(2)
            })
            .sum()
    }

    fn pixels(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.map.labels.len()).filter(|&k| self.label != 0 && self.map.labels[k] == self.label)
    }

    fn contains(&self, thick: &[f32], k: usize, point: Vec3) -> bool {
        let Some((at, z)) = self.map.camera.project(self.world.to_camera(point)) else { return false };
        let w = self.map.width as usize;
        if !(at[0] >= 0.0 && at[1] >= 0.0) || at[0] as usize >= w || at[1] as usize * w + at[0] as usize != k {
            return false;
        }
        let (Some(front), Some(thickness)) = (self.map.sample(&self.map.depth, at), self.map.sample(thick, at)) else {
            return false;
        };
        z >= front && z < front + thickness / self.map.camera.stretch(at)
    }

    /// Thickness, where needed raised to one layer of a lattice of this spacing. A slab holds a lattice point in
    /// every column along its dominant axis when it is one spacing thick along that axis, which along the ray is
    /// spacing · max|nᵢ| / |n · ray|.
    fn at_least_one_layer(&self, spacing: f32) -> Vec<f32> {
        let mut thick = self.thickness.to_vec();
        for k in self.pixels() {
            let ray = self.world.rotation * self.map.camera.unproject(self.map.pixel_center(k), 1.0).normalize();
            let normal = self.world.rotation * self.normal(k);
            let along = normal.dot(ray).abs().max(1e-6);
            thick[k] = thick[k].max(spacing * (normal.abs().max_element() / along).clamp(1.0, 4.0));
        }
        thick
    }

    /// Unit normal of the front surface in camera axes; the view ray where the pixel stands alone.
    fn normal(&self, k: usize) -> Vec3 {
        let at = |n: usize| self.map.camera.unproject(self.map.pixel_center(n), self.map.depth[n]);
        let w = self.map.width as usize;
        let mut tangent = [Vec3::ZERO; 2];
        for n in self.map.surface_neighbours(k) {
            let d = at(n) - at(k);
            let axis = usize::from(n.abs_diff(k) == w && (w > 1));
            tangent[axis] += if n > k { d } else { -d };
        }
        tangent[0].cross(tangent[1]).try_normalize().unwrap_or_else(|| at(k).normalize())
    }
}

#[cfg(test)]
#[path = "volume_tests.rs"]
mod tests;

//! Display points: the object's pixels as points of its front surface, carried by the nearest particles. Must not
//! know how particles move or how points are drawn.

use std::collections::HashMap;

use glam::DVec3;

use super::error::{GeometryError, positive};
use super::ground::WorldFromCamera;
use super::surface::SurfaceMap;

/// The pixels of one object as points.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct DisplayPoints {
    /// Index of the pixel, row-major at the working resolution.
    pub pixel: Vec<u32>,
    /// World position on the front surface [m].
    pub positions: Vec<[f32; 3]>,
    /// sRGB-encoded colour, 0–1.
    pub colors: Vec<[f32; 3]>,
    /// Distance [m] between neighbouring pixels at the point's depth; a disk of this radius covers its pixel.
    pub spacing: Vec<f32>,
}

/// What carries a display point X: x = Σ weight (x_p + F_p (X − X_p)).
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Carrier {
    /// Indices of the particles. With fewer than four particles the last repeats with weight 0.
    pub particle: [u32; 4],
    /// Not negative, sum 1.
    pub weight: [f32; 4],
}

/// The world point of a pixel's surface [m], and the distance between neighbouring pixels there [m]. On the host: drawing
/// takes all pixels at once from the kernel `points/unproject`.
pub fn surface_point<'a>(
    map: &'a SurfaceMap,
    world: &'a WorldFromCamera,
) -> impl Fn(usize) -> ([f32; 3], f32) + use<'a> {
    |k| {
        let position = world.to_world(map.camera.unproject(map.pixel_center(k), map.depth[k]));
        (position.to_array(), map.depth[k] / map.camera.focal_px)
    }
}

/// One display point per pixel of `label`, in pixel order, at `point(pixel)` with that spacing. `rgb` is the photograph,
/// encoded, width × height.
///
/// # Errors
/// [`GeometryError::EmptyMask`], [`GeometryError::SizeMismatch`].
pub fn display_points(
    map: &SurfaceMap,
    label: u8,
    rgb: &[[u8; 3]],
    point: impl Fn(usize) -> ([f32; 3], f32),
) -> Result<DisplayPoints, GeometryError> {
    if rgb.len() != map.depth.len() {
        return Err(GeometryError::SizeMismatch {
            what: "the image",
            width: map.width,
            height: map.height,
            got: rgb.len(),
        });
    }
    let mut points = DisplayPoints::default();
    for k in (0..map.labels.len()).filter(|&k| label != 0 && map.labels[k] == label) {
        let (position, spacing) = point(k);
        points.pixel.push(k as u32);
        points.positions.push(position);
        points.colors.push(rgb[k].map(|c| f32::from(c) / 255.0));
        points.spacing.push(spacing);
    }
    if points.pixel.is_empty() { Err(GeometryError::EmptyMask { label }) } else { Ok(points) }
}

/// Neighbours that carry a point.
const K: usize = 4;

/// The four nearest particles of each point with smooth weights. `particles` are those of the point's own object,
/// `spacing` their lattice spacing [m]. Deterministic: ties go to the lower index.
///
/// Weights are (1 − d²/r²)² with r a little beyond the fifth particle, so that a particle enters and leaves the
/// four nearest with almost no weight and neighbouring pixels do not tear.
///
/// # Errors
/// [`GeometryError::NotPositive`] when there is no particle or the spacing is not a length.
pub fn attach(points: &[[f32; 3]], particles: &[[f32; 3]], spacing: f32) -> Result<Vec<Carrier>, GeometryError> {
    positive("the number of particles", particles.len() as f64)?;
    let grid = Grid::new(particles, 2.0 * positive("the particle spacing", f64::from(spacing))?);
    let mut nearest = Vec::new();
    Ok(points
        .iter()
        .map(|point| {
            grid.nearest(DVec3::from(point.map(f64::from)), K + 1, &mut nearest);
            carrier(&nearest, f64::from(spacing))
        })
        .collect())
}

/// `nearest`: (distance, index), nearest first, K + 1 of them where there are that many particles.
fn carrier(nearest: &[(f64, u32)], spacing: f64) -> Carrier {
    let furthest = nearest.get(K).or(nearest.last()).map_or(0.0, |n| n.0);
    let reach = furthest + 0.1 * spacing;
    let mut carrier = Carrier { particle: [0; 4], weight: [0.0; 4] };
    let mut weight = [0.0; K];
    for slot in 0..K {
        let &(distance, particle) = &nearest[slot.min(nearest.len() - 1)];
        carrier.particle[slot] = particle;
        if slot < nearest.len() {
            weight[slot] = (1.0 - (distance / reach).powi(2)).powi(2);
        }
    }
    let sum: f64 = weight.iter().sum();
    carrier.weight = weight.map(|w| (w / sum) as f32);
    carrier
}

/// Particles sorted by cell, with where each cell begins.
struct Grid<'a> {
    particles: &'a [[f32; 3]],
    cell: f64,
    order: Vec<u32>,
    cells: HashMap<[i32; 3], (u32, u32)>,
}

/// Rings of cells searched before all particles are: beyond, a point is so far from its body that it happens rarely.
const RINGS: i32 = 4;

impl<'a> Grid<'a> {
    fn new(particles: &'a [[f32; 3]], cell: f64) -> Self {
        let mut keyed: Vec<([i32; 3], u32)> =
            particles.iter().enumerate().map(|(i, p)| (key(DVec3::from(p.map(f64::from)), cell), i as u32)).collect();
        keyed.sort_unstable();
        let mut cells = HashMap::new();
        let mut start = 0;
        for run in keyed.chunk_by(|a, b| a.0 == b.0) {
            let end = start + run.len() as u32;
            cells.insert(run[0].0, (start, end));
            start = end;
        }
        Self { particles, cell, order: keyed.iter().map(|k| k.1).collect(), cells }
    }

    /// Fills `found` with the `count` nearest particles as (distance, index), nearest first.
    fn nearest(&self, point: DVec3, count: usize, found: &mut Vec<(f64, u32)>) {
        found.clear();
        let center = key(point, self.cell);
        for ring in 0..=RINGS {
            for dz in -ring..=ring {
                for dy in -ring..=ring {
                    let on_shell = dz.abs() == ring || dy.abs() == ring;
                    // Inside the shell only its two ends along x belong to the ring.
                    let step = if on_shell || ring == 0 { 1 } else { 2 * ring as usize };
                    for dx in (-ring..=ring).step_by(step) {
                        let offset = [dx, dy, dz];
                        let cell = [0, 1, 2].map(|a| center[a].saturating_add(offset[a]));
                        if let Some(&(start, end)) = self.cells.get(&cell) {
                            found.extend(
                                self.order[start as usize..end as usize].iter().map(|&i| self.measure(point, i)),
                            );
                        }
                    }
                }
            }
            keep_nearest(found, count);
            // Whatever is not yet seen is at least `ring` cells away.
            let safe = f64::from(ring) * self.cell;
            if found.len() == count && found[count - 1].0 < safe {
                return;
            }
        }
        found.clear();
        found.extend((0..self.particles.len() as u32).map(|i| self.measure(point, i)));
        keep_nearest(found, count);
    }

    fn measure(&self, point: DVec3, index: u32) -> (f64, u32) {
        (DVec3::from(self.particles[index as usize].map(f64::from)).distance(point), index)
    }
}

fn keep_nearest(found: &mut Vec<(f64, u32)>, count: usize) {
    found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    found.truncate(count);
}

fn key(point: DVec3, cell: f64) -> [i32; 3] {
    (point / cell).floor().to_array().map(|c| c as i32)
}

#[cfg(test)]
mod tests {
    use glam::{DMat3, DVec3};

    use super::*;

    fn lattice(n: i32, s: f32) -> Vec<[f32; 3]> {
        (0..n * n * n).map(|k| [k % n, k / n % n, k / n / n].map(|c| (c as f32 + 0.5) * s)).collect()
    }

    /// Points of a seeded cloud, some outside the lattice of side 1.
    fn cloud(count: u32) -> Vec<[f32; 3]> {
        let hash = |k: u32| (k.wrapping_mul(2_654_435_761) >> 8) as f32 / (1 << 24) as f32;
        (0..count).map(|k| [0, 1, 2].map(|a| 1.2 * hash(3 * k + a + 1) - 0.1)).collect()
    }

    #[test]
    fn carriers_are_the_four_nearest_with_weights_that_sum_to_one() {
        let particles = lattice(10, 0.1);
        let mut points = cloud(300);
        points.push([5.0, 0.0, 0.0]); // far off: all particles are searched
        for (point, carrier) in points.iter().zip(attach(&points, &particles, 0.1).unwrap()) {
            let p = DVec3::from(point.map(f64::from));
            let mut all: Vec<(f64, u32)> = particles
                .iter()
                .enumerate()
                .map(|(i, q)| (DVec3::from(q.map(f64::from)).distance(p), i as u32))
                .collect();
            all.sort_by(|a, b| a.partial_cmp(b).unwrap());
            assert_eq!(carrier.particle, [all[0].1, all[1].1, all[2].1, all[3].1], "{point:?}");
            assert!((carrier.weight.iter().sum::<f32>() - 1.0).abs() < 1e-6);
            assert!(carrier.weight.iter().all(|&w| w >= 0.0) && carrier.weight[0] >= carrier.weight[3]);
        }
    }

    #[test]
    fn rigid_motion_of_particles_moves_points_rigidly() {
        let particles = lattice(10, 0.1);
        let points = cloud(500);
        let turn = DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.8);
        let shift = DVec3::new(0.3, -0.2, 1.1);
        for (point, carrier) in points.iter().zip(attach(&points, &particles, 0.1).unwrap()) {
            let rest = DVec3::from(point.map(f64::from));
            let mut moved = DVec3::ZERO;
            for (p, w) in carrier.particle.iter().zip(carrier.weight) {
                let from = DVec3::from(particles[*p as usize].map(f64::from));
                moved += f64::from(w) * (turn * from + shift + turn * (rest - from));
            }
            // Weights are stored in f32: they sum to 1 within 4 roundings of 6e-8, times positions of size 2.
            assert!(moved.distance(turn * rest + shift) < 1e-6);
        }
    }

    #[test]
    fn weights_change_smoothly_across_a_change_of_neighbours() {
        let particles = lattice(10, 0.1);
        // A line through several cells, off the lattice's symmetries; a bump of the particles is carried along it.
        let line: Vec<[f32; 3]> = (0..4000).map(|k| [0.2 + 1.5e-4 * k as f32, 0.433, 0.517]).collect();
        let bump = |p: u32| if p.is_multiple_of(3) { 0.01 } else { 0.0 };
        let carried: Vec<f32> = attach(&line, &particles, 0.1)
            .unwrap()
            .iter()
            .map(|c| c.particle.iter().zip(c.weight).map(|(p, w)| w * bump(*p)).sum())
            .collect();
        let most = carried.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
        // 0.01 m of motion between particles 0.1 m apart: at worst a few percent of it jumps.
        assert!(most < 5e-4, "{most}");
    }

    #[test]
    fn few_particles_are_enough_and_none_is_an_error() {
        let carrier = attach(&[[0.0; 3]], &[[0.1, 0.0, 0.0], [0.2, 0.0, 0.0]], 0.1).unwrap()[0];
        assert_eq!(carrier.particle, [0, 1, 1, 1]);
        assert_eq!(carrier.weight[2..], [0.0, 0.0]);
        assert!((carrier.weight[0] + carrier.weight[1] - 1.0).abs() < 1e-6);
        assert!(attach(&[[0.0; 3]], &[], 0.1).is_err());
    }
}

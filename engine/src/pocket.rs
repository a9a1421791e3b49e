//! Whether a liquid has room: the free space that it can reach between obstacles, against its volume. Runs on the CPU, where a
//! frame has gone wrong.

use std::collections::HashMap;

use physvideo_gpu::kernels::{Collider, Particle};

use crate::stages::solver::{BODY, Pressed, QUARANTINED};
use crate::walls::distance_at;

/// Side of the cells that are counted, over a particle's size. Those that a surface cuts count in part, exactly where it lies
/// along their faces.
const FINE: f32 = 0.5;
/// Share of the volume needed below which there is no room.
const ROOM: f64 = 0.995;
/// Least distance of a cell's middle from all obstacles for liquid to go on through it, over a particle's size: a slit of 0.3
/// has none, one of 0.8 has a row of them wherever the cells lie.
const PASSES: f32 = 0.15;
/// How many cells a particle that is behind a wall may be from the space it came from: 1.5 of its size.
const BEHIND: i32 = 3;

type Cell = [i32; 3];

/// Free space that is connected.
#[derive(Default)]
struct Space {
    cells: f64,
    /// It reaches further than anything needs.
    open: bool,
    /// Particles in it of each body.
    particles: HashMap<u32, u64>,
}

/// Obstacles and what lies between them.
#[derive(Clone, Debug)]
pub(crate) struct Pockets {
    /// Obstacles that the liquid meets.
    pub colliders: Vec<Collider>,
    /// Size of a particle [m].
    pub size: f32,
    /// Corners of the space that is simulated [m]; what reaches its edge is open.
    pub domain: ([f32; 3], [f32; 3]),
}

impl Pockets {
    /// The liquid for which obstacles leave too little room at `time`, if there is one.
    pub fn pressed(&self, particles: &[Particle], time: f64) -> Option<Pressed> {
        let there: Vec<&Particle> =
            particles.iter().filter(|p| p.tag & QUARANTINED == 0 && p.x.iter().all(|c| c.is_finite())).collect();
        let enough = there.len() as f64 / f64::from(FINE).powi(3);
        let (mut labels, mut spaces) = (HashMap::new(), Vec::<Space>::new());
        for p in there {
            let Some(cell) = self.nearest_open(p.x, time) else { continue };
            let label = match labels.get(&cell) {
                Some(label) => *label,
                None => {
                    let space = self.flood(cell, spaces.len(), enough, time, &mut labels, &spaces);
                    spaces.push(space);
                    spaces.len() - 1
                }
            };
            *spaces[label].particles.entry(p.tag & BODY).or_default() += 1;
        }
        let volume = f64::from(self.size).powi(3);
        let lacking = |s: &Space| {
            let needed = s.particles.values().sum::<u64>() as f64 * volume;
            let left = s.cells * volume * f64::from(FINE).powi(3);
            // Of two with as many particles the first.
            let (body, _) = s.particles.iter().max_by_key(|(body, n)| (**n, u32::MAX - **body))?;
            (!s.open && left < ROOM * needed).then_some(Pressed { body: *body, left, needed })
        };
        spaces.iter().find_map(lacking)
    }

    fn center(&self, cell: Cell) -> [f32; 3] {
        cell.map(|c| (c as f32 + 0.5) * FINE * self.size)
    }

    /// Share of a cell that is free, and whether liquid goes on through it.
    fn free(&self, cell: Cell, time: f64) -> (f32, bool) {
        let nearest = self.colliders.iter().map(|c| distance_at(c, self.center(cell), time)).fold(f32::MAX, f32::min);
        ((0.5 + nearest / (FINE * self.size)).clamp(0.0, 1.0), nearest >= PASSES * self.size)
    }

    /// The cell nearest to a place that liquid goes through.
    fn nearest_open(&self, x: [f32; 3], time: f64) -> Option<Cell> {
        let at = x.map(|c| (c / (FINE * self.size)).floor() as i32);
        if self.free(at, time).1 {
            return Some(at);
        }
        let around = || -BEHIND..=BEHIND;
        let all = around().flat_map(|i| around().flat_map(move |j| around().map(move |k| [i, j, k])));
        let far = |d: &[i32; 3]| d.iter().map(|c| c * c).sum::<i32>();
        let mut near: Vec<[i32; 3]> = all.collect();
        near.sort_by_key(far);
        near.iter().map(|d| [0, 1, 2].map(|a| at[a] + d[a])).find(|c| self.free(*c, time).1)
    }

    /// All that is connected with a cell, up to `enough` cells.
    fn flood(
        &self,
        from: Cell,
        label: usize,
        enough: f64,
        time: f64,
        labels: &mut HashMap<Cell, usize>,
        before: &[Space],
    ) -> Space {
        let mut space = Space { cells: self.free(from, time).0.into(), ..Default::default() };
        labels.insert(from, label);
        let mut edge = vec![from];
        let around: Vec<[i32; 3]> = (0..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]).collect();
        while let Some(cell) = edge.pop() {
            // What lies along a wall, in an edge or a corner counts, and ends there.
            for next in around.iter().map(|d| [0, 1, 2].map(|a| cell[a] + d[a])) {
                if let Some(other) = labels.get(&next) {
                    // The rest of one that was large enough.
                    space.open |= *other != label && before[*other].open && self.free(next, time).1;
                    continue;
                }
                let (free, passes) = self.free(next, time);
                if free > 0.0 {
                    let x = self.center(next);
                    space.open |= (0..3).any(|a| x[a] < self.domain.0[a] || x[a] > self.domain.1[a]);
                    labels.insert(next, label);
                    space.cells += f64::from(free);
                    if passes {
                        edge.push(next);
                    }
                }
            }
            space.open |= space.cells > enough;
            if space.open {
                break;
            }
        }
        space
    }
}

#[cfg(test)]
mod tests {
    use physvideo_gpu::kernels::family::shape::{BOX as SLAB, PLANE, ROOM as CLOSED};

    use super::*;

    /// 10³ particles of 1 cm in a room of their size, into which a lid of 0.1 m/s comes from above.
    fn pockets(half: f32, lid: f32) -> Pockets {
        let room = Collider {
            shape: CLOSED,
            center: [0.0, 0.0, 0.1, 0.0],
            size: [half, 0.05, 0.1, 0.0],
            end: 1e9,
            ..Default::default()
        };
        let lid = Collider {
            shape: PLANE,
            center: [0.0, 0.0, lid, 0.0],
            size: [0.0, 0.0, -1.0, 0.0],
            velocity: [0.0, 0.0, -0.1, 0.0],
            ..room
        };
        Pockets { colliders: vec![room, lid], size: 0.01, domain: ([-1.0; 3], [1.0; 3]) }
    }

    fn particles() -> Vec<Particle> {
        let at = |i: usize, c: usize| (i / 10usize.pow(c as u32) % 10) as f32 * 0.01 + 0.005;
        let place = |i: usize| [at(i, 0) - 0.05, at(i, 1) - 0.05, at(i, 2)];
        (0..1000).map(|i| Particle { x: place(i), tag: 3, ..Default::default() }).collect()
    }

    #[test]
    fn a_lid_presses_once_there_is_too_little_room() {
        let p = pockets(0.05, 0.15);
        assert_eq!(p.pressed(&particles(), 0.5), None, "it comes to the surface");
        let pressed = p.pressed(&particles(), 0.65).expect("there is no room for one and a half of ten layers");
        assert_eq!(pressed.body, 3);
        assert!((pressed.needed - 1e-3).abs() < 1e-8 && (pressed.left / 0.85e-3 - 1.0).abs() < 0.01, "{pressed:?}");
    }

    /// Neither its edges, nor slits that no particle goes through.
    #[test]
    fn a_lid_as_wide_as_the_room_leaves_no_way_out() {
        for gap in [0.0, 0.001, 0.003] {
            let mut fits = pockets(0.05, 0.15);
            let size = [0.05 - gap, 0.05 - gap, 0.1, 0.0];
            fits.colliders[1] = Collider { shape: SLAB, center: [0.0, 0.0, 0.25, 0.0], size, ..fits.colliders[1] };
            assert_eq!(fits.pressed(&particles(), 0.5), None, "it comes to the surface");
            let pressed = fits.pressed(&particles(), 0.65).expect("no way out");
            assert!((pressed.left / 0.85e-3 - 1.0).abs() < 0.08, "{gap}: {pressed:?}");
        }
        let mut slit = pockets(0.05, 0.15);
        let size = [0.042, 0.05, 0.1, 0.0];
        slit.colliders[1] = Collider { shape: SLAB, center: [0.0, 0.0, 0.25, 0.0], size, ..slit.colliders[1] };
        assert_eq!(slit.pressed(&particles(), 0.65), None, "there is one at the sides");
    }

    #[test]
    fn a_way_out_is_room() {
        assert_eq!(pockets(0.08, 0.15).pressed(&particles(), 0.8), None, "it can go to the side");
        let mut open = pockets(0.05, 0.15);
        open.colliders.remove(0);
        assert_eq!(open.pressed(&particles(), 1.4), None, "there is no room around it");
    }
}

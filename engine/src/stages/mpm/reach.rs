//! How far motion may come, in blocks of the grid. Knows no particle.

use physvideo_gpu::kernels::Grid;

/// Where the blocks of a grid are.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blocks {
    origin: [f32; 3],
    size: [u32; 3],
    /// Side of a cell, a quarter of a block's [m].
    pub dx: f32,
}

impl Blocks {
    pub fn of(grid: &Grid) -> Self {
        Self { origin: grid.origin, size: grid.blocks, dx: grid.dx }
    }

    /// How many there are.
    pub fn count(&self) -> usize {
        self.size.iter().map(|n| *n as usize).product()
    }

    /// The block that holds a particle at a point; a particle belongs to the first node it reaches.
    pub fn at(&self, x: [f32; 3]) -> Option<u32> {
        let at: [i64; 3] = std::array::from_fn(|a| self.along(x[a], a));
        (0..3).all(|a| (0..i64::from(self.size[a])).contains(&at[a])).then(|| self.index(at.map(|c| c as u32)) as u32)
    }

    /// Those of a box, as far as they are in the grid.
    pub fn within(&self, low: [f32; 3], high: [f32; 3]) -> impl Iterator<Item = u32> {
        let clamped = |x: f32, a: usize| self.along(x, a).clamp(0, i64::from(self.size[a]) - 1) as u32;
        let ends: [(u32, u32); 3] = std::array::from_fn(|a| (clamped(low[a], a), clamped(high[a], a)));
        self.all(ends).map(|at| at as u32)
    }

    /// A block and those that touch it.
    pub fn around(&self, block: u32) -> impl Iterator<Item = usize> {
        let [x, y, _] = self.size;
        let here = [block % x, block / x % y, block / (x * y)];
        self.all(std::array::from_fn(|a| (here[a].saturating_sub(1), (here[a] + 1).min(self.size[a] - 1))))
    }

    fn along(&self, x: f32, axis: usize) -> i64 {
        (((x - self.origin[axis]) / self.dx - 0.5) / 4.0).floor() as i64
    }

    fn index(&self, [x, y, z]: [u32; 3]) -> usize {
        ((z * self.size[1] + y) * self.size[0] + x) as usize
    }

    fn all(&self, [x, y, z]: [(u32, u32); 3]) -> impl Iterator<Item = usize> {
        let own = *self;
        let line = move |j, k| (x.0..=x.1).map(move |i| own.index([i, j, k]));
        (z.0..=z.1).flat_map(move |k| (y.0..=y.1).flat_map(move |j| line(j, k)))
    }
}

/// Which blocks are no further from any of `from` than that reaches, each given with its reach in blocks; diagonals count
/// as one. Each block is passed once: the furthest reach goes first.
pub(super) fn spread(place: &Blocks, from: impl Iterator<Item = (u32, u32)>) -> Vec<bool> {
    let longest = place.size.iter().copied().max().unwrap_or(0);
    let mut rounds: Vec<Vec<u32>> = vec![Vec::new(); longest as usize + 1];
    for (block, reach) in from {
        rounds[reach.min(longest) as usize].push(block);
    }
    let mut reached = vec![false; place.count()];
    while let Some(round) = rounds.pop() {
        for block in round {
            if std::mem::replace(&mut reached[block as usize], true) {
                continue;
            }
            if let Some(next) = rounds.last_mut() {
                next.extend(place.around(block).filter(|n| !reached[*n]).map(|n| n as u32));
            }
        }
    }
    reached
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place() -> Blocks {
        Blocks::of(&Grid { origin: [-1.0, 0.0, 0.0], dx: 0.25, blocks: [9, 6, 4], ..Default::default() })
    }

    /// Against the definition: the distance along the longest axis.
    #[test]
    fn motion_reaches_as_far_as_it_says() {
        let place = place();
        let coordinates = |b: u32| [b % 9, b / 9 % 6, b / 54].map(i64::from);
        let from = [(0, 2), (100, 1), (101, 0), (60, 0), (215, 40)];
        for some in 1..=from.len() {
            let got = spread(&place, from[..some].iter().copied());
            for (at, is) in got.iter().enumerate() {
                let near = |(b, reach): &(u32, u32)| {
                    let (a, b) = (coordinates(at as u32), coordinates(*b));
                    (0..3).map(|i| (a[i] - b[i]).abs()).max() <= Some(i64::from(*reach))
                };
                assert_eq!(*is, from[..some].iter().any(near), "block {at} from the first {some}");
            }
        }
    }

    #[test]
    fn a_particle_belongs_to_the_first_node_it_reaches() {
        let place = place();
        // A block is a metre wide; the first node is half a cell to a cell and a half below.
        assert_eq!(place.at([-1.0 + 0.13, 0.13, 0.13]), Some(0));
        assert_eq!(place.at([0.1249, 0.13, 0.13]), Some(0));
        assert_eq!(place.at([0.1251, 0.13, 0.13]), Some(1));
        assert_eq!(place.at([0.0, 0.0, 0.0]), None);
        assert_eq!(
            place.within([0.5, 0.5, -9.0], [1.5, 0.6, 9.0]).collect::<Vec<_>>(),
            [1, 2, 55, 56, 109, 110, 163, 164]
        );
        assert_eq!((place.around(0).count(), place.around(9 * 6 + 10).count()), (8, 27));
    }
}

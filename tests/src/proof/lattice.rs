//! What the `cells` kernels together promise, worked out on the host: active blocks, cells and an order of particles.
//! Knows what a cell is, and nothing of stress or motion.

use std::collections::{BTreeMap, BTreeSet};

use physvideo_gpu::kernels::{Counts, Grid, Particle, Row};

use super::cloud::QUARANTINED;
use crate::random::Random;

/// Names behind the end of the list of particles that are worked on, which nobody may look at.
const BEHIND: usize = 2;

/// Numbers of the particles that are worked on, in no order: all, or two in three where the seed says so. The clock of a
/// call says how many are not.
pub fn awake(items: usize, seed: u64) -> Vec<u32> {
    let there = (0..items as u32).rev().filter(|p| seed % 4 != 3 || p % 3 != 1);
    there.chain([0; BEHIND]).collect()
}

/// How many of `items` particles a list leaves out.
pub fn idle(awake: &[u32], items: usize) -> u32 {
    (items + BEHIND - awake.len()) as u32
}

/// Whether each of `items` particles is worked on.
pub fn busy(awake: &[u32], items: usize) -> Vec<bool> {
    let mut busy = vec![false; items];
    awake[..awake.len() - BEHIND].iter().for_each(|p| busy[*p as usize] = true);
    busy
}

/// Key of a particle that is in no cell.
pub const NOWHERE: u32 = u32::MAX;
/// Nodes a block's particles reach.
pub const TILE: usize = 216;

/// First node reached along each axis, when all nodes reached lie inside the grid.
///
/// A quadratic B-spline at x reaches the nodes closer than 1.5 dx: the first is ⌊(x − origin)/dx − ½⌋.
pub fn base(grid: &Grid, x: [f32; 3]) -> Option<[u32; 3]> {
    let mut node = [0; 3];
    for axis in 0..3 {
        let first = ((f64::from(x[axis]) - f64::from(grid.origin[axis])) / f64::from(grid.dx) - 0.5).floor();
        let last = f64::from(grid.blocks[axis] * 4) - 1.0;
        if !(first >= 0.0 && first + 2.0 <= last) {
            return None;
        }
        node[axis] = first as u32;
    }
    Some(node)
}

/// Block · 64 + cell, or [`NOWHERE`] for a particle that is quarantined, not finite or outside the grid.
pub fn key(grid: &Grid, p: &Particle) -> u32 {
    let sound = p.tag & QUARANTINED == 0 && p.x.iter().chain(&p.v).all(|c| c.is_finite());
    let Some(node) = base(grid, p.x).filter(|_| sound) else { return NOWHERE };
    let block = index(grid, node.map(|n| n / 4));
    let cell = (node[2] % 4) * 16 + (node[1] % 4) * 4 + node[0] % 4;
    block * 64 + cell
}

/// Index of a block.
pub fn index(grid: &Grid, b: [u32; 3]) -> u32 {
    (b[2] * grid.blocks[1] + b[1]) * grid.blocks[0] + b[0]
}

/// Coordinates of a block.
pub fn coordinates(grid: &Grid, block: u32) -> [u32; 3] {
    let [x, y, _] = grid.blocks;
    [block % x, block / x % y, block / (x * y)]
}

/// Slots of the eight blocks at and below each slot's, as far as they hold particles, then of the eight at and above it,
/// [`NOWHERE`] for none; then the fills of those below.
pub fn links(grid: &Grid, table: &[u32], list: &[u32], blocks: usize, fills: &[u32]) -> Vec<u32> {
    let around = |block: u32| {
        let b = coordinates(grid, block).map(i64::from);
        [-1, 1].into_iter().flat_map(move |way| {
            (0..8i64).map(move |i| [b[0] + way * (i & 1), b[1] + way * (i >> 1 & 1), b[2] + way * (i >> 2)])
        })
    };
    let slot = |at: [i64; 3]| {
        let inside = (0..3).all(|a| (0..i64::from(grid.blocks[a])).contains(&at[a]));
        if inside { table[index(grid, at.map(|c| c as u32)) as usize].wrapping_sub(1) } else { NOWHERE }
    };
    let fill = |slot: &u32| fills.get(*slot as usize).copied().unwrap_or(0);
    list.iter()
        .flat_map(|block| {
            let mut slots: Vec<u32> = around(*block).map(slot).collect();
            slots[..8].iter_mut().filter(|slot| **slot >= blocks as u32).for_each(|slot| *slot = NOWHERE);
            let below: Vec<u32> = slots[..8].iter().map(fill).collect();
            [slots, below].concat()
        })
        .collect()
}

/// The block of a cell (by its key) and those of its upper neighbours whose nodes the cell's particles reach.
pub fn reached(grid: &Grid, key: u32) -> Vec<u32> {
    let b = coordinates(grid, key / 64);
    let local = [key % 4, key / 4 % 4, key / 16 % 4];
    let mut found = Vec::new();
    for corner in 0..8u32 {
        let up = [corner & 1, corner >> 1 & 1, corner >> 2];
        let at: [u32; 3] = std::array::from_fn(|axis| b[axis] + up[axis]);
        if (0..3).all(|axis| at[axis] < grid.blocks[axis] && (up[axis] == 0 || local[axis] >= 2)) {
            found.push(index(grid, at));
        }
    }
    found
}

/// A valid outcome of locate, count, range and place; within a cell the particles are in a random order.
#[derive(Clone, Debug)]
pub struct Lattice {
    /// With a capacity of just the slots and rows needed.
    pub grid: Grid,
    /// Slots that hold particles; they come first.
    pub blocks: usize,
    /// Cell of each particle.
    pub keys: Vec<u32>,
    /// Slot + 1 of each block of the grid, 0 when it is not active.
    pub table: Vec<u32>,
    /// Block of each slot.
    pub list: Vec<u32>,
    /// Particles of each cell, 64 a slot.
    pub counts: Vec<u32>,
    /// First place of each cell in `order`.
    pub starts: Vec<u32>,
    /// Place of each particle in its cell.
    pub ranks: Vec<u32>,
    /// Particles by cell; as long as there are particles, the unsound ones leave its end empty.
    pub order: Vec<u32>,
    /// First place and number of particles of each slot.
    pub spans: Vec<[u32; 2]>,
    /// The rows of four cells that hold particles, in a random order.
    pub rows: Vec<Row>,
    /// Place of each row in `rows` + 1, 0 where it is empty.
    pub marks: Vec<u32>,
    /// Slots below and above each slot, and the fills of those below.
    pub links: Vec<u32>,
    /// Which rows of each slot hold particles, a bit each.
    pub fills: Vec<u32>,
}

impl Lattice {
    /// Sorts particles into the cells of a grid.
    pub fn new(mut grid: Grid, particles: &[Particle], seed: u64) -> Self {
        let mut random = Random::new(seed ^ 0xce11);
        let keys: Vec<_> = particles.iter().map(|p| key(&grid, p)).collect();
        let mut cells: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (p, key) in keys.iter().enumerate().filter(|(_, k)| **k != NOWHERE) {
            cells.entry(*key).or_default().push(p as u32);
        }
        let holding: BTreeSet<u32> = cells.keys().map(|k| k / 64).collect();
        let all: BTreeSet<u32> = cells.keys().flat_map(|key| reached(&grid, *key)).collect();
        let mut list: Vec<u32> = holding.iter().copied().collect();
        random.shuffle(&mut list);
        let mut upper: Vec<u32> = all.difference(&holding).copied().collect();
        random.shuffle(&mut upper);
        list.extend(upper);
        grid.capacity = list.len() as u32;
        grid.rows = cells.keys().map(|key| key / 4).collect::<BTreeSet<_>>().len() as u32;
        let mut table = vec![0; grid.blocks.iter().product::<u32>() as usize];
        for (slot, block) in list.iter().enumerate() {
            table[*block as usize] = slot as u32 + 1;
        }
        let fills: Vec<u32> = list
            .iter()
            .map(|b| cells.range(b * 64..b * 64 + 64).fold(0, |bits, (key, _)| bits | 1 << (key % 64 / 4)))
            .collect();
        let links = links(&grid, &table, &list, holding.len(), &fills);
        let mut made = Self {
            grid,
            blocks: holding.len(),
            table,
            counts: vec![0; list.len() * 64],
            starts: vec![0; list.len() * 64],
            ranks: vec![0; keys.len()],
            order: vec![0; keys.len()],
            spans: vec![[0; 2]; list.len()],
            rows: Vec::new(),
            marks: vec![0; list.len() * 16],
            links,
            fills,
            list,
            keys,
        };
        made.fill(cells, &mut random);
        random.shuffle(&mut made.rows);
        for (at, row) in made.rows.iter().enumerate() {
            made.marks[row.id as usize] = at as u32 + 1;
        }
        made
    }

    fn fill(&mut self, mut cells: BTreeMap<u32, Vec<u32>>, random: &mut Random) {
        let mut cursor = 0;
        for slot in 0..self.blocks {
            self.spans[slot][0] = cursor as u32;
            for cell in 0..64 {
                let mut members = cells.remove(&(self.list[slot] * 64 + cell as u32)).unwrap_or_default();
                random.shuffle(&mut members);
                self.starts[slot * 64 + cell] = cursor as u32;
                self.counts[slot * 64 + cell] = members.len() as u32;
                for (rank, p) in members.iter().enumerate() {
                    self.ranks[*p as usize] = rank as u32;
                    self.order[cursor + rank] = *p;
                }
                cursor += members.len();
            }
            for row in 0..16 {
                let cells = slot * 64 + row * 4..slot * 64 + row * 4 + 4;
                let count = self.counts[cells.clone()].iter().sum();
                if count > 0 {
                    let (id, first) = ((slot * 16 + row) as u32, self.starts[cells.start]);
                    self.rows.push(Row { id, first, count, block: self.list[slot] });
                }
            }
            self.spans[slot][1] = cursor as u32 - self.spans[slot][0];
        }
    }

    /// The counters as the sort leaves them.
    pub fn counters(&self) -> Counts {
        Counts {
            blocks: self.blocks as u32,
            nodes: self.list.len() as u32,
            rows: self.rows.len() as u32,
            cursor: self.spans.iter().map(|s| s[1]).sum(),
            ..Default::default()
        }
    }

    /// Slot · 64 + cell of each particle, as `cells/place` leaves its key.
    pub fn cells(&self) -> Vec<u32> {
        let cell = |key: &u32| match *key {
            NOWHERE => NOWHERE,
            key => (self.table[key as usize / 64] - 1) * 64 + key % 64,
        };
        self.keys.iter().map(cell).collect()
    }

    /// Particles of a slot.
    pub fn members(&self, slot: usize) -> Vec<usize> {
        let block = self.list[slot];
        (0..self.keys.len()).filter(|p| self.keys[*p] != NOWHERE && self.keys[*p] / 64 == block).collect()
    }
}

//! For every patch that touches the hole, a similar patch of known pixels: PatchMatch (Barnes et al. 2009), with
//! propagation from the previous pass only, so that the result does not depend on the order or number of threads.
//! Knows nothing of how the matches become colours.

use super::mask::{Size, touching_squares, whole_squares};
use super::parallel::fill_with;
use super::pyramid::{Level, Look};

/// No target has this index.
pub(super) const NONE: u32 = u32::MAX;

/// The most one pixel may add to a difference (a colour about 55 levels off): a rim of the object left outside the mask
/// must not choose what fills the hole.
const CAP: f32 = 3000.0;

/// How much near sources are preferred. Perspective, light and folds change across a picture; and a singular feature (a
/// sharp fold) somewhere else must not be drawn in by a hole that merely begins in shade.
const LOCALITY: f32 = 12.0;

/// The best source found for a target patch.
#[derive(Debug, Clone, Copy)]
pub(super) struct Match {
    /// Centre of the source patch, as a flat pixel index.
    pub source: u32,
    /// See [`Patches::cost`].
    pub cost: f32,
}

/// The patches of one level: which are wanted, which may be given.
pub(super) struct Patches {
    pub size: Size,
    /// Patches have (2·radius + 1)² pixels.
    pub radius: usize,
    /// How much a pixel counts in a comparison: 1 where known, less the deeper in the hole, 0 where out.
    pub weight: Vec<f32>,
    /// Whether a pixel is the centre of a wholly known patch.
    pub is_source: Vec<bool>,
    /// The centres of wholly known patches, in scan order.
    pub sources: Vec<u32>,
    /// The centres of patches that touch the hole, in scan order.
    pub targets: Vec<u32>,
    /// Pixel to index in `targets`, or [`NONE`].
    pub target_of: Vec<u32>,
}

impl Patches {
    /// `radius` is an upper bound: it shrinks where image or known regions are too thin for such a patch. `None` when
    /// nothing is usable.
    pub fn new(level: &Level, radius: usize) -> Option<Patches> {
        let size = level.size;
        let usable = level.usable();
        let mut radius = radius.min((size.w.min(size.h) - 1) / 2);
        let is_source = loop {
            let found = whole_squares(size, &usable, radius);
            if found.contains(&true) {
                break found;
            }
            radius = radius.checked_sub(1)?;
        };
        let is_target = touching_squares(size, &level.hole, radius);
        let list = |set: &[bool]| (0..size.area() as u32).filter(|&i| set[i as usize]).collect::<Vec<u32>>();
        let (sources, targets) = (list(&is_source), list(&is_target));
        let mut target_of = vec![NONE; size.area()];
        for (n, &t) in targets.iter().enumerate() {
            target_of[t as usize] = n as u32;
        }
        // The deeper, the more a colour is a guess made from guesses.
        let trust = |(&d, &out): (&u32, &bool)| if out { 0.0 } else { 0.9f32.powi(d.min(100) as i32).max(0.15) };
        let weight = level.depth().iter().zip(&level.out).map(trust).collect();
        Some(Patches { size, radius, weight, is_source, sources, targets, target_of })
    }

    /// What a source costs for being far away: 1 at the same place, 1 + [`LOCALITY`] across the diagonal.
    fn remoteness(&self, target: usize, source: usize) -> f32 {
        let ((tx, ty), (sx, sy)) = (self.size.xy(target), self.size.xy(source));
        let (dx, dy) = (tx.abs_diff(sx) as f32, ty.abs_diff(sy) as f32);
        let (w, h) = (self.size.w as f32, self.size.h as f32);
        1.0 + LOCALITY * ((dx * dx + dy * dy) / (w * w + h * h)).sqrt()
    }

    /// Weighted sum of squared differences of two patches, times the remoteness of the source; may stop early, with a
    /// value of at least `bound`.
    pub fn cost(&self, color: &[Look], weight: &[f32], target: usize, source: usize, bound: f32) -> f32 {
        let (w, r) = (self.size.w, self.radius);
        let side = 2 * r + 1;
        let corner = r * w + r;
        let (mut t, mut s) = (target - corner, source - corner);
        let far = self.remoteness(target, source);
        let bound = bound / far;
        let mut sum = 0.0;
        for _ in 0..side {
            let rows = color[t..t + side].iter().zip(&color[s..s + side]).zip(&weight[t..t + side]);
            for ((a, b), k) in rows {
                let d = [a[0] - b[0], a[1] - b[1], a[2] - b[2], a[3] - b[3], a[4] - b[4]];
                sum += k * (d[0] * d[0] + d[1] * d[1] + d[2] * d[2] + d[3] * d[3] + d[4] * d[4]).min(CAP);
            }
            if sum >= bound {
                return sum * far;
            }
            t += w;
            s += w;
        }
        sum * far
    }

    /// A source for every target, drawn evenly.
    pub fn random_field(&self, seed: u64) -> Vec<Match> {
        let draw = |&t: &u32| {
            let mut rng = Rng::new(seed, u64::from(t));
            Match { source: self.sources[rng.below(self.sources.len())], cost: f32::INFINITY }
        };
        self.targets.iter().map(draw).collect()
    }

    /// The field of a level of half the size, carried over; sources that do not exist here are drawn anew.
    pub fn enlarged_field(&self, coarse: &Patches, field: &[Match], seed: u64) -> Vec<Match> {
        let mut fine = self.random_field(seed);
        if field.is_empty() {
            return fine;
        }
        for (&t, m) in self.targets.iter().zip(&mut fine) {
            let (x, y) = self.size.xy(t as usize);
            let clamp = |v: usize, n: usize| v.clamp(coarse.radius, n - 1 - coarse.radius);
            let (cx, cy) = (clamp(x / 2, coarse.size.w), clamp(y / 2, coarse.size.h));
            let n = coarse.target_of[cy * coarse.size.w + cx];
            if n == NONE {
                continue;
            }
            let (sx, sy) = coarse.size.xy(field[n as usize].source as usize);
            // The shift doubles; the place inside the coarse pixel stays.
            let along = |fine: usize, source: usize, center: usize| 2 * source as i64 + fine as i64 - 2 * center as i64;
            if let Some(s) = self.source_at(along(x, sx, cx), along(y, sy, cy)) {
                m.source = s;
            }
        }
        fine
    }

    fn source_at(&self, x: i64, y: i64) -> Option<u32> {
        if x < 0 || y < 0 || x >= self.size.w as i64 || y >= self.size.h as i64 {
            return None;
        }
        let i = y as usize * self.size.w + x as usize;
        self.is_source[i].then_some(i as u32)
    }

    /// Costs of `field` for the colours as they are now.
    pub fn rescore(&self, threads: usize, color: &[Look], field: &mut [Match]) {
        let old = field.to_vec();
        fill_with(threads, field, |n| {
            let source = old[n].source;
            let cost = self.cost(color, &self.weight, self.targets[n] as usize, source as usize, f32::INFINITY);
            Match { source, cost }
        });
    }

    /// `passes` rounds of propagation over 8, 4, 2 and 1 pixels and of random search; costs must be up to date.
    pub fn improve(&self, threads: usize, color: &[Look], field: &mut Vec<Match>, passes: u32, seed: u64) {
        let mut old = field.clone();
        for pass in 0..passes {
            for step in [8, 4, 2, 1] {
                std::mem::swap(&mut old, field);
                fill_with(threads, field, |n| self.propagate(color, &old, n, step));
            }
            std::mem::swap(&mut old, field);
            fill_with(threads, field, |n| self.wander(color, old[n], n, mix(seed ^ u64::from(pass))));
        }
    }

    /// Tries the shifts of the neighbours `step` pixels away.
    fn propagate(&self, color: &[Look], old: &[Match], n: usize, step: i64) -> Match {
        let mut best = old[n];
        let t = self.targets[n] as usize;
        let (x, y) = self.size.xy(t);
        for (dx, dy) in [(-step, 0), (step, 0), (0, -step), (0, step)] {
            let (u, v) = (x as i64 + dx, y as i64 + dy);
            if u < 0 || v < 0 || u >= self.size.w as i64 || v >= self.size.h as i64 {
                continue;
            }
            let neighbour = self.target_of[v as usize * self.size.w + u as usize];
            if neighbour == NONE {
                continue;
            }
            let (sx, sy) = self.size.xy(old[neighbour as usize].source as usize);
            if let Some(s) = self.source_at(sx as i64 - dx, sy as i64 - dy) {
                self.consider(color, &mut best, t, s);
            }
        }
        best
    }

    /// Tries random sources, ever closer to the best one.
    fn wander(&self, color: &[Look], mut best: Match, n: usize, seed: u64) -> Match {
        let t = self.targets[n] as usize;
        let mut rng = Rng::new(seed, t as u64);
        let mut reach = self.size.w.max(self.size.h) as i64;
        while reach >= 1 {
            let (sx, sy) = self.size.xy(best.source as usize);
            let mut draw = || rng.below(2 * reach as usize + 1) as i64 - reach;
            let (dx, dy) = (draw(), draw());
            if let Some(s) = self.source_at(sx as i64 + dx, sy as i64 + dy) {
                self.consider(color, &mut best, t, s);
            }
            reach /= 2;
        }
        best
    }

    fn consider(&self, color: &[Look], best: &mut Match, target: usize, source: u32) {
        if source == best.source {
            return;
        }
        let cost = self.cost(color, &self.weight, target, source as usize, best.cost);
        if cost < best.cost {
            *best = Match { source, cost };
        }
    }
}

/// SplitMix64 (Steele et al. 2014): one stream per seed and pixel.
pub(super) struct Rng(u64);

impl Rng {
    pub fn new(seed: u64, pixel: u64) -> Rng {
        Rng(mix(seed ^ mix(pixel)))
    }

    /// Evenly in 0..n, n ≥ 1.
    pub fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        ((u128::from(mix(self.0)) * n as u128) >> 64) as usize
    }
}

/// The finaliser of SplitMix64: every bit of the input reaches every bit of the output.
pub(super) fn mix(seed: u64) -> u64 {
    let z = seed.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

//! Completion of depth inside masks: which surface an unmeasured pixel belongs to, and a first value for it. Must
//! not know how surfaces are smoothed afterwards.

use std::cmp::Reverse;
use std::collections::{BinaryHeap, VecDeque};

use super::photo::PhotoData;

/// Surfaces smaller than this are mismatches of the depth sensor and are measured anew from their neighbours.
const SMALLEST_SURFACE: usize = 16;
/// Cost of one step of the growth; one unit of colour difference costs 1. Eight levels of 255 are noise in a
/// photograph, so that in even colour the nearest surface wins and across a colour edge growth waits.
const STEP_COST: u32 = 8;

/// Inverse depth of the pixels of some labels.
pub(super) struct Completed {
    /// Inverse depth [1/m]; 0 outside the labels.
    pub inverse: Vec<f32>,
    /// Steps to the measured pixel the value came from; 0 where measured.
    pub distance: Vec<u32>,
    /// Connected surface the value came from; meaningless outside the labels.
    pub surface: Vec<u32>,
}

/// The four neighbours of pixel `k` inside the picture.
pub(super) fn neighbours(k: usize, width: usize, height: usize) -> impl Iterator<Item = usize> {
    let (x, y) = (k % width, k / width);
    let left = (x > 0).then(|| k - 1);
    let right = (x + 1 < width).then(|| k + 1);
    let up = (y > 0).then(|| k - width);
    let down = (y + 1 < height).then(|| k + width);
    [left, right, up, down].into_iter().flatten()
}

/// Gives every pixel of `labels` the inverse depth of a measured pixel of its own label: the one that is nearest
/// along a path inside the mask, where crossing colour edges is long. `edge(q)` is the jump of inverse depth that
/// separates two surfaces.
pub(super) fn complete(photo: &PhotoData, labels: &[u8], edge: impl Fn(f32) -> f32) -> Completed {
    let (width, height) = (photo.width as usize, photo.height as usize);
    let wanted = |k: usize| labels.contains(&photo.labels[k]);
    let mut inverse: Vec<f32> = (0..photo.depth.len())
        .map(|k| if wanted(k) && photo.depth[k] > 0.0 { 1.0 / photo.depth[k] } else { 0.0 })
        .collect();
    let joined = |q: &[f32], a: usize, b: usize| {
        photo.labels[a] == photo.labels[b] && q[a] > 0.0 && q[b] > 0.0 && (q[a] - q[b]).abs() <= edge(q[a].min(q[b]))
    };
    let (mut surface, sizes) = surfaces(&inverse, width, height, &joined);
    for &label in labels {
        let of_label = |k: usize| photo.labels[k] == label && inverse[k] > 0.0;
        let any_large = (0..inverse.len()).any(|k| of_label(k) && sizes[surface[k] as usize] >= SMALLEST_SURFACE);
        if any_large {
            for k in 0..inverse.len() {
                if photo.labels[k] == label && inverse[k] > 0.0 && sizes[surface[k] as usize] < SMALLEST_SURFACE {
                    inverse[k] = 0.0;
                }
            }
        }
    }

    let mut growth = Growth::new(photo, &inverse);
    growth.inside_masks();
    for &label in labels {
        growth.islands(label);
    }
    let Growth { source, distance, .. } = growth;
    for k in (0..inverse.len()).filter(|&k| wanted(k) && source[k] != NONE) {
        inverse[k] = inverse[source[k]];
        surface[k] = surface[source[k]];
    }
    Completed { inverse, distance, surface }
}

/// Connected surfaces of the measured pixels, and the size of each.
fn surfaces(
    inverse: &[f32],
    width: usize,
    height: usize,
    joined: &impl Fn(&[f32], usize, usize) -> bool,
) -> (Vec<u32>, Vec<usize>) {
    let mut surface = vec![u32::MAX; inverse.len()];
    let mut sizes = Vec::new();
    let mut stack = Vec::new();
    for seed in 0..inverse.len() {
        if inverse[seed] == 0.0 || surface[seed] != u32::MAX {
            continue;
        }
        let id = sizes.len() as u32;
        let mut size = 0;
        surface[seed] = id;
        stack.push(seed);
        while let Some(k) = stack.pop() {
            size += 1;
            for n in neighbours(k, width, height) {
                if surface[n] == u32::MAX && joined(inverse, k, n) {
                    surface[n] = id;
                    stack.push(n);
                }
            }
        }
        sizes.push(size);
    }
    (surface, sizes)
}

const NONE: usize = usize::MAX;

/// Growth of the measured pixels over the others.
struct Growth<'a> {
    photo: &'a PhotoData,
    /// The measured pixel that each pixel takes its value from.
    source: Vec<usize>,
    /// Steps to it.
    distance: Vec<u32>,
}

impl<'a> Growth<'a> {
    fn new(photo: &'a PhotoData, inverse: &[f32]) -> Self {
        let source: Vec<usize> = (0..inverse.len()).map(|k| if inverse[k] > 0.0 { k } else { NONE }).collect();
        let distance = source.iter().map(|&s| if s == NONE { u32::MAX } else { 0 }).collect();
        Self { photo, source, distance }
    }

    fn neighbours(&self, k: usize) -> impl Iterator<Item = usize> + use<> {
        neighbours(k, self.photo.width as usize, self.photo.height as usize)
    }

    /// Dijkstra's growth along paths that stay in one label.
    fn inside_masks(&mut self) {
        let labels = &self.photo.labels;
        let mut cost: Vec<u32> = self.source.iter().map(|&s| if s == NONE { u32::MAX } else { 0 }).collect();
        let mut front: BinaryHeap<Reverse<(u32, usize)>> = (0..cost.len())
            .filter(|&k| cost[k] == 0 && self.neighbours(k).any(|n| cost[n] != 0 && labels[n] == labels[k]))
            .map(|k| Reverse((0, k)))
            .collect();
        while let Some(Reverse((at, k))) = front.pop() {
            if at > cost[k] {
                continue;
            }
            for n in self.neighbours(k) {
                let next = at + STEP_COST + colour_difference(self.photo.rgb[k], self.photo.rgb[n]);
                if labels[n] == labels[k] && next < cost[n] {
                    cost[n] = next;
                    self.source[n] = self.source[k];
                    self.distance[n] = self.distance[k] + 1;
                    front.push(Reverse((next, n)));
                }
            }
        }
    }

    /// Pieces of a mask without any measurement take the value of the nearest pixel of their label, wherever.
    fn islands(&mut self, label: u8) {
        let is = |k: usize| self.photo.labels[k] == label;
        if !(0..self.source.len()).any(|k| is(k) && self.source[k] == NONE) {
            return;
        }
        let mut from: Vec<usize> = (0..self.source.len()).map(|k| if is(k) { self.source[k] } else { NONE }).collect();
        let mut front: VecDeque<usize> = (0..from.len()).filter(|&k| from[k] != NONE).collect();
        while let Some(k) = front.pop_front() {
            for n in self.neighbours(k) {
                if from[n] == NONE {
                    from[n] = from[k];
                    front.push_back(n);
                }
            }
        }
        for (k, nearest) in from.into_iter().enumerate() {
            if self.photo.labels[k] == label && self.source[k] == NONE {
                self.source[k] = nearest;
                self.distance[k] = 1;
            }
        }
    }
}

fn colour_difference(a: [u8; 3], b: [u8; 3]) -> u32 {
    (0..3).map(|c| u32::from(a[c].abs_diff(b[c]))).max().unwrap_or(0)
}

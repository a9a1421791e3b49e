//! Measures of pictures: likeness, what stands still, what was left open. Knows nothing of particles.

/// An 8-bit RGB picture, rows from the top.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Columns.
    pub width: usize,
    /// One colour a pixel.
    pub rgb: Vec<[u8; 3]>,
}

fn squared(a: [u8; 3], b: [u8; 3]) -> f64 {
    (0..3).map(|c| (f64::from(a[c]) - f64::from(b[c])).powi(2)).sum()
}

/// Peak signal to noise ratio [dB] over the pixels of `mask`; infinite where they are the same.
pub fn psnr(a: &Picture, b: &Picture, mask: &[bool]) -> f64 {
    let inside: Vec<f64> =
        a.rgb.iter().zip(&b.rgb).zip(mask).filter(|(_, m)| **m).map(|((a, b), _)| squared(*a, *b)).collect();
    let mean = inside.iter().sum::<f64>() / (3 * inside.len().max(1)) as f64;
    10.0 * (255.0f64.powi(2) / mean).log10()
}

/// Pixels of `mask` that differ.
pub fn changed(a: &Picture, b: &Picture, mask: &[bool]) -> usize {
    a.rgb.iter().zip(&b.rgb).zip(mask).filter(|((a, b), m)| **m && a != b).count()
}

/// The whole-pixel shift of at most 3 px in each direction by which `b` looks most like `a` inside `mask`. Of equally
/// good ones the smallest.
pub fn shift(a: &Picture, b: &Picture, mask: &[bool]) -> [i32; 2] {
    let (w, h) = (a.width as i32, (a.rgb.len() / a.width) as i32);
    let mut best = (f64::INFINITY, i32::MAX, [0, 0]);
    for v in -3..=3 {
        for u in -3..=3 {
            let (mut sum, mut count) = (0.0, 0);
            for i in (0..a.rgb.len()).filter(|i| mask[*i]) {
                let (x, y) = (i as i32 % w + u, i as i32 / w + v);
                if (0..w).contains(&x) && (0..h).contains(&y) {
                    sum += squared(a.rgb[i], b.rgb[(y * w + x) as usize]);
                    count += 1;
                }
            }
            let mean = sum / f64::from(count.max(1));
            if (mean, u * u + v * v) < (best.0, best.1) {
                best = (mean, u * u + v * v, [u, v]);
            }
        }
    }
    best.2
}

/// What each pixel shows whenever nothing that moves is near: the colour seen most often (Boyer and Moore's vote).
pub struct Still {
    /// The colours.
    pub picture: Picture,
    /// Frames in which each pixel was free.
    pub seen: Vec<u32>,
    votes: Vec<u32>,
}

impl Still {
    /// Nothing seen yet.
    pub fn new(width: usize, pixels: usize) -> Self {
        let picture = Picture { width, rgb: vec![[0; 3]; pixels] };
        Self { picture, seen: vec![0; pixels], votes: vec![0; pixels] }
    }

    /// Looks at a frame where it is not `covered`.
    pub fn see(&mut self, frame: &Picture, covered: &[bool]) {
        for i in (0..covered.len()).filter(|i| !covered[*i]) {
            self.seen[i] += 1;
            if self.votes[i] == 0 {
                (self.picture.rgb[i], self.votes[i]) = (frame.rgb[i], 1);
            } else if self.picture.rgb[i] == frame.rgb[i] {
                self.votes[i] += 1;
            } else {
                self.votes[i] -= 1;
            }
        }
    }
}

/// Pixels of `object` that were uncovered and not filled: with their eight neighbours, uncovered too, they still show
/// the photograph, or one flat colour that the photograph does not have there. A single pixel may look like the
/// photograph by chance, nine do not.
pub fn unfilled(still: &Still, photo: &Picture, object: &[bool]) -> usize {
    let (w, h) = (photo.width, photo.rgb.len() / photo.width);
    let mut count = 0;
    for y in 1..h.saturating_sub(1) {
        for x in 1..w.saturating_sub(1) {
            let block: [usize; 9] = std::array::from_fn(|k| (y + k / 3 - 1) * w + x + k % 3 - 1);
            if block.iter().any(|i| !object[*i] || still.seen[*i] == 0) {
                continue;
            }
            let flat = |p: &Picture| block.iter().all(|i| p.rgb[*i] == p.rgb[block[0]]);
            let same = block.iter().all(|i| still.picture.rgb[*i] == photo.rgb[*i]);
            count += usize::from(same || (flat(&still.picture) && !flat(photo)));
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn noise(seed: u64) -> Picture {
        let mut random = Random::new(seed);
        Picture { width: 24, rgb: (0..24 * 20).map(|_| [0; 3].map(|_: u8| random.below(256) as u8)).collect() }
    }

    #[test]
    fn psnr_is_that_of_the_definition() {
        let a = noise(1);
        let mut b = a.clone();
        let mask: Vec<bool> = (0..a.rgb.len()).map(|i| i % 2 == 0).collect();
        assert_eq!(psnr(&a, &b, &mask), f64::INFINITY);
        b.rgb.iter_mut().for_each(|c| *c = c.map(|v| if v < 128 { v + 16 } else { v - 16 }));
        // An error of 16 everywhere: 20 log10(255 / 16).
        assert!((psnr(&a, &b, &mask) - 24.048).abs() < 1e-3);
        assert_eq!(changed(&a, &b, &mask), a.rgb.len() / 2);
    }

    #[test]
    fn a_shift_is_found() {
        let a = noise(2);
        let inside: Vec<bool> =
            (0..a.rgb.len()).map(|i| (4..20).contains(&(i % 24)) && (4..16).contains(&(i / 24))).collect();
        let moved =
            Picture { width: 24, rgb: (0..a.rgb.len()).map(|i| a.rgb[(i + 480 - 2 - 24) % 480]).collect::<Vec<_>>() };
        assert_eq!(shift(&a, &a, &inside), [0, 0]);
        assert_eq!(shift(&a, &moved, &inside), [2, 1]);
    }

    #[test]
    fn what_stays_is_seen_through_what_passes() {
        let (background, mut still) = (noise(3), Still::new(24, 480));
        for t in 0..9 {
            let mut frame = background.clone();
            let mut covered = vec![false; 480];
            // A column that passes and is known to, and a stray pixel that is not.
            (0..20).for_each(|y| (frame.rgb[y * 24 + t], covered[y * 24 + t]) = ([0; 3], true));
            frame.rgb[5 * 24 + 10 + t] = [255; 3];
            still.see(&frame, &covered);
        }
        assert_eq!(still.picture, background);
        assert_eq!((still.seen[0], still.seen[20]), (8, 9));
    }

    #[test]
    fn ghosts_and_flat_patches_are_unfilled() {
        let (photo, filled) = (noise(4), noise(5));
        let object = vec![true; 480];
        let mut still = Still::new(24, 480);
        still.see(&filled, &[false; 480]);
        assert_eq!(unfilled(&still, &photo, &object), 0);
        for i in (0..3).flat_map(|y| (0..3).map(move |x| y * 24 + x)) {
            still.picture.rgb[i] = photo.rgb[i];
            still.picture.rgb[i + 10] = [255, 0, 255];
        }
        assert_eq!(unfilled(&still, &photo, &object), 2);
        // What was never uncovered cannot be judged.
        still.seen[25] = 0;
        assert_eq!(unfilled(&still, &photo, &object), 1);
    }
}

//! The image at halved sizes with its masks, and its slow shading taken out. Knows nothing of patches.

use super::mask::{Size, depth_inside};

/// Channels of a [`Look`].
pub(super) const LOOK: usize = 5;

/// What patches are compared by: red, green, blue [0..255, shading taken out], then how busy the full-size picture is
/// around the pixel along x and along y (the texture features of Newson et al. 2014). Without the latter a flat grey
/// area is the nearest patch to every half-blurred one, and spreads.
pub(super) type Look = [f32; LOOK];

/// One size of the picture.
#[derive(Debug, Clone)]
pub(super) struct Level {
    pub size: Size,
    /// Colour with the shading taken out; only the current guess inside the hole.
    pub color: Vec<Look>,
    /// To be filled.
    pub hole: Vec<bool>,
    /// Neither filled nor looked at: known pixels that are not part of the texture.
    pub out: Vec<bool>,
}

impl Level {
    /// Pixels that may be copied.
    pub fn usable(&self) -> Vec<bool> {
        self.hole.iter().zip(&self.out).map(|(&h, &o)| !h && !o).collect()
    }

    /// How far [px] every pixel is from one that may be copied.
    pub fn depth(&self) -> Vec<u32> {
        let unusable: Vec<bool> = self.usable().iter().map(|&u| !u).collect();
        depth_inside(self.size, &unusable)
    }

    /// Half the size, rounded up. A coarse pixel is a hole when any of its pixels is one, so that no half-known
    /// colour counts as known; it is out when any of them is.
    pub fn halved(&self) -> Level {
        let fine = self.size;
        let size = Size { w: fine.w.div_ceil(2), h: fine.h.div_ceil(2) };
        let mut level = Level {
            size,
            color: vec![[0.0; LOOK]; size.area()],
            hole: vec![false; size.area()],
            out: vec![false; size.area()],
        };
        for i in 0..size.area() {
            let (x, y) = size.xy(i);
            let (mut sum, mut n) = ([0.0; LOOK], 0.0);
            for v in 2 * y..(2 * y + 2).min(fine.h) {
                for u in 2 * x..(2 * x + 2).min(fine.w) {
                    let j = v * fine.w + u;
                    level.hole[i] |= self.hole[j];
                    level.out[i] |= self.out[j];
                    sum.iter_mut().zip(&self.color[j]).for_each(|(s, c)| *s += c);
                    n += 1.0;
                }
            }
            level.color[i] = sum.map(|s| s / n);
            level.out[i] &= !level.hole[i];
        }
        level
    }
}

/// The slow part of each colour channel [0..255] at every pixel, continued smoothly where `usable` is false: a pull-push
/// pyramid of the colours of `usable` pixels, read at blocks of about 2^`octaves` pixels.
///
/// Dividing it out lets a texture lit brightly stand in for the same texture in shade.
pub(super) fn shading(size: Size, rgb: &[[u8; 3]], usable: &[bool], octaves: usize) -> Vec<[f32; 3]> {
    // Colour times weight, and weight.
    let see = |(c, &ok): (&[u8; 3], &bool)| {
        if ok { [f32::from(c[0]), f32::from(c[1]), f32::from(c[2]), 1.0] } else { [0.0; 4] }
    };
    let mut stack = vec![(size, rgb.iter().zip(usable).map(see).collect::<Vec<_>>())];
    while let Some((s, seen)) = stack.last().filter(|(s, _)| s.area() > 1) {
        let next = pull(*s, seen);
        stack.push(next);
    }
    // Push: each size takes what it does not know from the next coarser one; sizes finer than `octaves` are only
    // interpolated, which is what keeps the texture out of the shading.
    let mut coarse = (Size { w: 1, h: 1 }, vec![[0.0; 3]]);
    for (depth, (s, seen)) in stack.iter().enumerate().rev() {
        let mut fine = enlarge(coarse.0, &coarse.1, *s);
        // Few octaves exist in a small picture: its one pixel at the top is then all the shading there is.
        if depth >= octaves.min(stack.len() - 1) {
            for (f, s) in fine.iter_mut().zip(seen).filter(|(_, s)| s[3] > 0.0) {
                for c in 0..3 {
                    f[c] = s[c] + (1.0 - s[3]) * f[c];
                }
            }
        }
        if depth + 1 == stack.len() {
            // Nothing is coarser: what is known must do for the rest.
            for (f, s) in fine.iter_mut().zip(seen).filter(|(_, s)| s[3] > 0.0) {
                *f = [s[0] / s[3], s[1] / s[3], s[2] / s[3]];
            }
        }
        coarse = (*s, fine);
    }
    coarse.1
}

fn pull(fine: Size, seen: &[[f32; 4]]) -> (Size, Vec<[f32; 4]>) {
    let size = Size { w: fine.w.div_ceil(2), h: fine.h.div_ceil(2) };
    let mut out = vec![[0.0f32; 4]; size.area()];
    for (i, o) in out.iter_mut().enumerate() {
        let (x, y) = size.xy(i);
        // A tent of 4 × 4 rather than a block of 2 × 2: blocks would print their grid on the shading.
        const TENT: [(i64, f32); 4] = [(-1, 1.0), (0, 3.0), (1, 3.0), (2, 1.0)];
        let mut total = 0.0;
        for (v, wv) in TENT {
            for (u, wu) in TENT {
                let (u, v) = (2 * x as i64 + u, 2 * y as i64 + v);
                if u < 0 || v < 0 || u >= fine.w as i64 || v >= fine.h as i64 {
                    continue;
                }
                let s = seen[v as usize * fine.w + u as usize];
                for c in 0..4 {
                    o[c] += wu * wv * s[c];
                }
                total += wu * wv;
            }
        }
        *o = o.map(|s| s / total);
    }
    (size, out)
}

/// Bilinear enlargement by two; the outer edges of the two sizes line up.
fn enlarge(coarse: Size, values: &[[f32; 3]], fine: Size) -> Vec<[f32; 3]> {
    let along = |i: usize, n: usize| {
        let at = ((i as f32 + 0.5) / 2.0 - 0.5).clamp(0.0, (n - 1) as f32);
        let low = at as usize;
        (low, (low + 1).min(n - 1), at - low as f32)
    };
    let mix = |a: [f32; 3], b: [f32; 3], t: f32| [0, 1, 2].map(|c| a[c] * (1.0 - t) + b[c] * t);
    (0..fine.area())
        .map(|i| {
            let (x, y) = fine.xy(i);
            let ((x0, x1, fx), (y0, y1, fy)) = (along(x, coarse.w), along(y, coarse.h));
            let row = |v: usize| mix(values[v * coarse.w + x0], values[v * coarse.w + x1], fx);
            mix(row(y0), row(y1), fy)
        })
        .collect()
}

/// Adds the texture features to `color`: mean |∂x| and |∂y| of brightness over squares of (2·`REACH` + 1)² pixels,
/// from `usable` pixels only, weighed by `GAIN`.
pub(super) fn looks(size: Size, color: &[[f32; 3]], usable: &[bool]) -> Vec<Look> {
    // A square spans a pixel of the coarsest size used; the gain brings busy and flat about as far apart as light and
    // dark.
    const REACH: usize = 8;
    const GAIN: f32 = 5.0;
    let bright: Vec<f32> = color.iter().map(|c| (c[0] + c[1] + c[2]) / 3.0).collect();
    // Sums of |∂x|, |∂y| and how many of each are known.
    let mut sums: Vec<[f32; 4]> = (0..size.area())
        .map(|i| {
            let (x, y) = size.xy(i);
            let step = |inside: bool, j: usize| {
                if inside && usable[i] && usable[j] { [(bright[j] - bright[i]).abs(), 1.0] } else { [0.0; 2] }
            };
            let (dx, dy) = (step(x + 1 < size.w, i + 1), step(y + 1 < size.h, i + size.w));
            [dx[0], dx[1], dy[0], dy[1]]
        })
        .collect();
    // Box sums by rows, then by columns.
    for (lines, length, stride, next) in [(size.h, size.w, 1, size.w), (size.w, size.h, size.w, 1)] {
        for line in 0..lines {
            let values: Vec<[f32; 4]> = (0..length).map(|k| sums[line * next + k * stride]).collect();
            for k in 0..length {
                let part = &values[k.saturating_sub(REACH)..(k + REACH + 1).min(length)];
                let mut sum = [0.0; 4];
                part.iter().for_each(|v| (0..4).for_each(|c| sum[c] += v[c]));
                sums[line * next + k * stride] = sum;
            }
        }
    }
    let mean = |s: f32, n: f32| if n > 0.0 { GAIN * s / n } else { 0.0 };
    color.iter().zip(&sums).map(|(c, s)| [c[0], c[1], c[2], mean(s[0], s[1]), mean(s[2], s[3])]).collect()
}

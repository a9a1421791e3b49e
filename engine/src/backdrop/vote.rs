//! From matches to colours: a first guess from the hole's edge inwards, then voting (Wexler et al. 2007). Knows nothing
//! of how matches are improved.

use super::mask::Size;
use super::parallel::fill_with;
use super::patchmatch::{Match, NONE, Patches};
use super::pyramid::{LOOK, Level};

/// At most so many sources are tried for a pixel of the first guess.
const PEEL_TRIES: usize = 6000;

/// A first guess of the hole's colours: ring after ring from its edge inwards, each pixel the centre of the known patch
/// that agrees best with what is filled so far.
pub(super) fn peel(threads: usize, level: &mut Level, patches: &Patches) {
    let size = level.size;
    let depth = level.depth();
    let deepest = depth.iter().copied().max().unwrap_or(0);
    let mut weight: Vec<f32> = patches.weight.iter().zip(&level.hole).map(|(&w, &h)| if h { 0.0 } else { w }).collect();
    let stride = patches.sources.len().div_ceil(PEEL_TRIES).max(1);
    for ring in 1..=deepest {
        let pixels: Vec<usize> = (0..size.area()).filter(|&i| level.hole[i] && depth[i] == ring).collect();
        let mut colors = vec![[0.0; LOOK]; pixels.len()];
        fill_with(threads, &mut colors, |n| {
            let (x, y) = size.xy(pixels[n]);
            // At the image border the patch stays inside and the pixel is not its centre.
            let inside = |v: usize, n: usize| v.clamp(patches.radius, n - 1 - patches.radius);
            let target = inside(y, size.h) * size.w + inside(x, size.w);
            let mut best = Match { source: patches.sources[0], cost: f32::INFINITY };
            for &s in patches.sources.iter().step_by(stride) {
                let cost = patches.cost(&level.color, &weight, target, s as usize, best.cost);
                if cost < best.cost {
                    best = Match { source: s, cost };
                }
            }
            level.color[best.source as usize + pixels[n] - target]
        });
        for (&i, c) in pixels.iter().zip(&colors) {
            level.color[i] = *c;
            weight[i] = patches.weight[i];
        }
    }
}

/// Every hole pixel becomes the mean of what the patches over it ask for, the better matches counting more.
/// `sharpness` scales how much more: at 0 all count the same.
pub(super) fn vote(threads: usize, level: &mut Level, patches: &Patches, field: &[Match], sharpness: f32) {
    let size = level.size;
    let mut costs: Vec<f32> = field.iter().map(|m| m.cost).collect();
    let middle = costs.len() * 3 / 4;
    if middle >= costs.len() {
        return;
    }
    let (_, &mut scale, _) = costs.select_nth_unstable_by(middle, f32::total_cmp);
    let scale = sharpness / (2.0 * scale.max(1.0));
    // The floor keeps a pixel that only bad matches cover from losing them all to underflow; costs not yet known are
    // infinite, and then all are.
    let strength: Vec<f32> =
        field.iter().map(|m| if m.cost.is_finite() { (-m.cost * scale).exp().max(1e-12) } else { 1.0 }).collect();
    let pixels: Vec<usize> = (0..size.area()).filter(|&i| level.hole[i]).collect();
    let mut colors = vec![[0.0; LOOK]; pixels.len()];
    fill_with(threads, &mut colors, |n| {
        let (mut sum, mut total) = ([0.0; LOOK], 0.0);
        for_covering(size, patches, pixels[n], |t| {
            let (m, k) = (field[t], strength[t]);
            let source = level.color[m.source as usize + pixels[n] - patches.targets[t] as usize];
            for c in 0..LOOK {
                sum[c] += k * source[c];
            }
            total += k;
        });
        if total > 0.0 { sum.map(|s| s / total) } else { level.color[pixels[n]] }
    });
    for (&i, c) in pixels.iter().zip(&colors) {
        level.color[i] = *c;
    }
}

/// Calls `see` with every target whose patch covers pixel `i`.
fn for_covering(size: Size, patches: &Patches, i: usize, mut see: impl FnMut(usize)) {
    let (x, y) = size.xy(i);
    let r = patches.radius;
    for v in y.saturating_sub(r)..=(y + r).min(size.h - 1) {
        for &t in &patches.target_of[v * size.w + x.saturating_sub(r)..=v * size.w + (x + r).min(size.w - 1)] {
            if t != NONE {
                see(t as usize);
            }
        }
    }
}

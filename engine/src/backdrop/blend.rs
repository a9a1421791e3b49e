//! The last step: every hole pixel is copied from one known pixel, and the seams between copies are evened out in the
//! gradient domain. Knows nothing of how the copies were chosen.

use super::mask::Size;
use super::parallel::fill_with;
use super::patchmatch::{Match, Patches};
use super::pyramid::{LOOK, Level, Look};

/// For every pixel the flat index it is copied from; known pixels from themselves.
pub(super) fn copies(level: &Level, patches: &Patches, field: &[Match]) -> Vec<u32> {
    let size = level.size;
    let inside = |v: usize, n: usize| v.clamp(patches.radius, n - 1 - patches.radius);
    (0..size.area())
        .map(|i| {
            if !level.hole[i] {
                return i as u32;
            }
            let (x, y) = size.xy(i);
            let t = inside(y, size.h) * size.w + inside(x, size.w);
            let m = field[patches.target_of[t] as usize];
            (m.source as usize + i - t) as u32
        })
        .collect()
}

/// How strongly the copied colours are held against the gradients: seams fade over about 1/√SCREEN = 10 px.
const SCREEN: f32 = 0.01;
/// Gauss-Seidel spreads by about one pixel times √(2 · sweeps): far enough for a fade of that length.
const SWEEPS: usize = 60;

/// Copies, then minimises SCREEN · (f − copy)² + |∇f − ∇copy|² over the hole, the known pixels held: seams fade and the
/// texture between them stays as copied. `from` as of [`copies`].
pub(super) fn blend(threads: usize, level: &Level, from: &[u32]) -> Vec<Look> {
    let color = &level.color;
    let size = level.size;
    let copy: Vec<Look> = from.iter().map(|&s| color[s as usize]).collect();
    let holes: Vec<u32> = (0..size.area() as u32).filter(|&i| level.hole[i as usize]).collect();
    // Right side of the normal equations: SCREEN · copy + the gradients wanted towards each neighbour.
    let mut wanted = vec![([0.0; LOOK], 0.0); holes.len()];
    fill_with(threads, &mut wanted, |n| {
        let i = holes[n] as usize;
        let mut sum = copy[i].map(|c| SCREEN * c);
        let mut diagonal = SCREEN;
        for (j, step) in neighbours(size, i) {
            if level.out[j] {
                continue;
            }
            // The gradient i → j as each of the two copies has it; a source's neighbour may be no source.
            let (a, b) = (from[i] as i64 + step, from[j] as i64 - step);
            let (near, far) = (&copy[i], &copy[j]);
            let ahead = pick(level, size, from[i] as usize, a);
            let behind = pick(level, size, from[j] as usize, b);
            for c in 0..LOOK {
                let mut g = 0.0;
                let mut k = 0.0;
                if let Some(a) = ahead {
                    g += near[c] - color[a][c];
                    k += 1.0;
                }
                if let Some(b) = behind {
                    g += color[b][c] - far[c];
                    k += 1.0;
                }
                sum[c] += if k > 0.0 { g / k } else { 0.0 };
            }
            diagonal += 1.0;
        }
        (sum, diagonal)
    });
    let mut f = copy;
    // Red-black Gauss-Seidel: each half depends on the other half only, so threads do not matter.
    let halves: [Vec<usize>; 2] = [0, 1].map(|parity| {
        (0..holes.len())
            .filter(|&n| {
                let (x, y) = size.xy(holes[n] as usize);
                (x + y) % 2 == parity
            })
            .collect()
    });
    let mut next: [Vec<Look>; 2] = [0, 1].map(|h: usize| vec![[0.0; LOOK]; halves[h].len()]);
    for _ in 0..SWEEPS {
        for (half, next) in halves.iter().zip(&mut next) {
            fill_with(threads, next, |k| {
                let n = half[k];
                let i = holes[n] as usize;
                let (mut sum, diagonal) = wanted[n];
                for (j, _) in neighbours(size, i) {
                    if !level.out[j] {
                        for c in 0..LOOK {
                            sum[c] += f[j][c];
                        }
                    }
                }
                sum.map(|s| s / diagonal)
            });
            for (&n, c) in half.iter().zip(next.iter()) {
                f[holes[n] as usize] = *c;
            }
        }
    }
    f
}

/// The neighbour at flat index `j` of a source at `i`, when it is a known pixel of the texture beside it.
fn pick(level: &Level, size: Size, i: usize, j: i64) -> Option<usize> {
    let j = usize::try_from(j).ok().filter(|&j| j < size.area())?;
    let (a, b) = (size.xy(i), size.xy(j));
    let beside = a.0.abs_diff(b.0) + a.1.abs_diff(b.1) == 1;
    (beside && !level.hole[j] && !level.out[j]).then_some(j)
}

/// The 4-neighbours inside the image, each with its flat step.
fn neighbours(size: Size, i: usize) -> impl Iterator<Item = (usize, i64)> {
    let (x, y) = size.xy(i);
    let w = size.w as i64;
    [(x > 0, -1), (x + 1 < size.w, 1), (y > 0, -w), (y + 1 < size.h, w)]
        .into_iter()
        .filter(|&(inside, _)| inside)
        .map(move |(_, step)| ((i as i64 + step) as usize, step))
}

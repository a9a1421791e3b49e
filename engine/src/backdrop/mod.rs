//! The picture behind moving objects: a photograph with a hole, the hole filled by copies of the texture around it
//! (exemplar completion after Wexler et al. 2007 and Newson et al. 2014, over PatchMatch, Barnes et al. 2009). Knows
//! nothing of scenes, files or the GPU.

mod blend;
mod mask;
mod parallel;
mod patchmatch;
mod pyramid;
mod vote;

#[cfg(test)]
mod tests;

pub use mask::{close, dilate};

use mask::Size;
use patchmatch::{Match, Patches, mix};
use pyramid::Level;

/// Settings of [`fill`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct FillSettings {
    /// Seed of the random search.
    pub seed: u64,
    /// Threads to use; 0 means as many as the machine offers. The result does not depend on it.
    pub threads: usize,
}

/// Why a hole could not be filled.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum FillError {
    /// The picture has no pixels, or more than can be indexed.
    #[error("background fill: a picture of {width} × {height} pixels cannot be filled; give 1 to 2³¹ pixels")]
    Picture {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// An array does not have one entry per pixel.
    #[error("background fill: `{array}` has {found} entries for {expected} pixels; give one per pixel, row by row")]
    Size {
        /// Which array.
        array: &'static str,
        /// Entries it has.
        found: usize,
        /// Pixels of the picture.
        expected: usize,
    },
    /// There is a hole, but nothing to copy from.
    #[error(
        "background fill: no pixel to copy from: {hole} of {pixels} pixels are hole and {excluded} more are excluded; \
         shrink the object's mask or exclude less"
    )]
    NothingKnown {
        /// Pixels to fill.
        hole: usize,
        /// Pixels outside the hole that were excluded.
        excluded: usize,
        /// Pixels of the picture.
        pixels: usize,
    },
}

/// Patches have (2 · 3 + 1)² pixels.
const RADIUS: usize = 3;
/// Sizes of the pyramid: at an eighth a patch spans 56 px of the picture, more than a period of most textures, and
/// periods of 40 px are still seen.
const LEVELS: usize = 4;
/// Brightness slower than 2⁴ px is shading, the rest is texture.
const SHADING_OCTAVES: usize = 4;
/// Shading is divided out to this level, so that differences keep the scale of 8-bit colours …
const MIDDLE: f32 = 128.0;
/// … and this is added to it first, so that deep shade does not blow up its noise.
const GLOOM: f32 = 16.0;
/// How much better matches outvote worse ones.
const SHARPNESS: f32 = 4.0;

/// Fills the pixels of `rgb` (row-major, `width` × `height`, sRGB) where `hole` is true by continuing the texture of the
/// others, which are returned unchanged. Pixels where `exclude` is true (an object in front of the same background) are
/// neither copied nor continued.
///
/// Leave a margin around the object: [`close`] its mask and grow it by some pixels with [`dilate`], or its rim is taken
/// for background. Where it hides a part of an excluded thing, fill that part by a second call that excludes all else.
///
/// # Errors
/// Arrays of another size, a picture of no pixels, or no pixel that is neither hole nor excluded while there is a hole.
pub fn fill(
    width: u32,
    height: u32,
    rgb: &[[u8; 3]],
    hole: &[bool],
    exclude: Option<&[bool]>,
    settings: FillSettings,
) -> Result<Vec<[u8; 3]>, FillError> {
    let size = checked_size(width, height)?;
    check_len("rgb", size, rgb.len())?;
    check_len("hole", size, hole.len())?;
    if let Some(exclude) = exclude {
        check_len("exclude", size, exclude.len())?;
    }
    let out: Vec<bool> = match exclude {
        Some(exclude) => exclude.iter().zip(hole).map(|(&e, &h)| e && !h).collect(),
        None => vec![false; size.area()],
    };
    let count = |mask: &[bool]| mask.iter().filter(|&&m| m).count();
    let (holes, outs) = (count(hole), count(&out));
    if holes == 0 {
        return Ok(rgb.to_vec());
    }
    let nothing = FillError::NothingKnown { hole: holes, excluded: outs, pixels: size.area() };
    if holes + outs == size.area() {
        return Err(nothing);
    }
    let threads = match settings.threads {
        0 => std::thread::available_parallelism().map_or(1, |n| n.get()),
        n => n,
    };
    complete(threads, size, rgb, hole, out, settings.seed).ok_or(nothing)
}

/// Coarse to fine: guess, then match and vote in turns; at full size copy. `None` when no pixel may be copied.
fn complete(
    threads: usize,
    size: Size,
    rgb: &[[u8; 3]],
    hole: &[bool],
    out: Vec<bool>,
    seed: u64,
) -> Option<Vec<[u8; 3]>> {
    let mut level = Level { size, color: Vec::new(), hole: hole.to_vec(), out };
    let usable = level.usable();
    let gain = |v: f32| (v + GLOOM) / (MIDDLE + GLOOM);
    let light: Vec<[f32; 3]> =
        pyramid::shading(size, rgb, &usable, SHADING_OCTAVES).into_iter().map(|s| s.map(gain)).collect();
    let flat: Vec<[f32; 3]> = rgb.iter().zip(&light).map(|(c, l)| [0, 1, 2].map(|k| f32::from(c[k]) / l[k])).collect();
    level.color = pyramid::looks(size, &flat, &usable);

    let mut levels = stack(level);
    let mut coarser: Option<(Patches, Vec<Match>)> = None;
    while let Some(mut level) = levels.pop() {
        let depth = levels.len() as u64;
        let patches = Patches::new(&level, RADIUS)?;
        let stream = |n: u64| mix(seed ^ mix((depth << 32) | n));
        let mut field = match &coarser {
            None => {
                vote::peel(threads, &mut level, &patches);
                patches.random_field(stream(0))
            }
            Some((coarse, field)) => {
                let field = patches.enlarged_field(coarse, field, stream(0));
                vote::vote(threads, &mut level, &patches, &field, 0.0);
                field
            }
        };
        // The coarsest size settles what goes where and is cheap; the finest only sharpens, and is not.
        let (rounds, passes) = match (&coarser, levels.is_empty()) {
            (_, true) => (2, 2),
            (None, false) => (10, 3),
            (Some(_), false) => (5, 3),
        };
        for round in 0..rounds {
            patches.rescore(threads, &level.color, &mut field);
            patches.improve(threads, &level.color, &mut field, passes, stream(1 + round));
            vote::vote(threads, &mut level, &patches, &field, SHARPNESS);
        }
        if levels.is_empty() {
            patches.rescore(threads, &level.color, &mut field);
            patches.improve(threads, &level.color, &mut field, 1, stream(1 + rounds));
            let filled = blend::blend(threads, &level, &blend::copies(&level, &patches, &field));
            let lit = |i: usize| [0, 1, 2].map(|c| (filled[i][c] * light[i][c]).round().clamp(0.0, 255.0) as u8);
            return Some((0..size.area()).map(|i| if hole[i] { lit(i) } else { rgb[i] }).collect());
        }
        coarser = Some((patches, field));
    }
    None
}

/// The full size and as many halved ones as help: until the hole is no deeper than a patch reaches, or its surroundings
/// hold no whole patch, or the texture itself would be averaged away.
fn stack(level: Level) -> Vec<Level> {
    let mut levels = vec![level];
    while let Some(last) = levels.last() {
        let holes = last.depth().into_iter().zip(&last.hole).filter(|&(_, &h)| h);
        let deepest = holes.map(|(d, _)| d as usize).max().unwrap_or(0);
        if deepest <= RADIUS || levels.len() == LEVELS {
            break;
        }
        let next = last.halved();
        if !mask::whole_squares(next.size, &next.usable(), RADIUS).contains(&true) {
            break;
        }
        levels.push(next);
    }
    levels
}

fn checked_size(width: u32, height: u32) -> Result<Size, FillError> {
    let area = u64::from(width) * u64::from(height);
    if area == 0 || area > 1 << 31 {
        return Err(FillError::Picture { width, height });
    }
    Ok(Size { w: width as usize, h: height as usize })
}

fn check_len(array: &'static str, size: Size, found: usize) -> Result<(), FillError> {
    let expected = size.area();
    if found == expected { Ok(()) } else { Err(FillError::Size { array, found, expected }) }
}

//! Proofs of `wgsl/points`, and the inputs they share. The twins of drawing live in `twins::points`.

pub mod bin_count;
pub mod bin_place;
pub mod bin_range;
pub mod bind;
pub mod blend;
pub mod blend_shared;
pub mod carry;
pub mod compose;
pub mod nearest32;
pub mod nearest64;
pub mod project;
pub mod resolve;
pub mod scenery;
pub mod uncover;
pub mod unproject;

use physvideo::scene::Compositing;

use super::{Ask, Call};
use crate::twins::points::{Pixel, Scene, draw};

/// A disc of the twins: centre [px], depth [m], radius [px]; none where nothing is drawn.
pub type Disc = Option<[f64; 4]>;
/// Number of no point.
pub const NOTHING: u32 = u32::MAX;
/// Size of most images, in no direction a whole number of tiles [px].
pub const SIZE: [u32; 2] = [37, 29];

/// A call with a lane per item; odd seeds fold the workgroups into two rows.
fn each(items: usize, ask: Ask) -> Call {
    Call::new(items.div_ceil(64)).rows(1 + (ask.seed % 2) as u32)
}

/// Sides of an image of so many pixels, as square as can be.
pub(super) fn image(pixels: usize) -> [u32; 2] {
    let width = (1..=pixels).take_while(|w| w * w <= pixels).filter(|w| pixels.is_multiple_of(*w)).last().unwrap_or(0);
    [width as u32, pixels.checked_div(width).unwrap_or(0) as u32]
}

/// What `project` writes, as the twins see it.
fn seen(splats: &[[f32; 4]]) -> Vec<Disc> {
    splats.iter().map(|s| (s[3] > 0.0).then_some(s.map(f64::from))).collect()
}

/// The nearest point of every pixel; its number is in `id`.
fn nearest(discs: &[Disc], size: [u32; 2], margin: [f64; 2]) -> Vec<Pixel> {
    let numbers: Vec<u32> = (0..discs.len() as u32).collect();
    draw(&Scene {
        discs,
        colors: &vec![0; discs.len()],
        objects: &numbers,
        size,
        k: 1,
        compositing: Compositing::NormWeighted,
        blend_depth: None,
        margin,
        closed: false,
    })
}

/// The points of every tile of 8 × 8 pixels: those whose bounding square holds a pixel centre of the tile.
fn lists(discs: &[Disc], size: [u32; 2]) -> Vec<Vec<u32>> {
    let [across, down] = size.map(|s| s.div_ceil(8));
    let mut tiles = vec![Vec::new(); (across * down) as usize];
    for (i, disc) in discs.iter().enumerate() {
        let Some([x, y, _, r]) = *disc else { continue };
        let within = |tile: u32, size: u32, at: f64| {
            (tile * 8..size.min(tile * 8 + 8)).any(|p| (f64::from(p) + 0.5 - at).abs() <= r)
        };
        for row in (0..down).filter(|t| within(*t, size[1], y)) {
            for column in (0..across).filter(|t| within(*t, size[0], x)) {
                tiles[(row * across + column) as usize].push(i as u32);
            }
        }
    }
    tiles
}

/// First places of the tiles' lists one behind the other, the last tile first: their order is chance.
fn starts(counts: &[u32]) -> Vec<u32> {
    let mut starts = vec![0; counts.len()];
    for tile in (1..counts.len()).rev() {
        starts[tile - 1] = starts[tile] + counts[tile];
    }
    starts
}

/// Red, green and blue of packed colours, then the alphas.
fn channels(words: &[u32]) -> (Vec<f64>, Vec<u32>) {
    let rgb = words.iter().flat_map(|w| [0, 8, 16].map(|s| f64::from((w >> s) & 0xff)));
    (rgb.collect(), words.iter().map(|w| w >> 24).collect())
}

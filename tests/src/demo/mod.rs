//! What the demo promises, measured on what it wrote. Reads no files and knows no scene.

mod motion;
mod picture;

pub use motion::{islands, paths, project, reach, reversals, tips};
pub use picture::{Picture, Still, changed, psnr, shift, unfilled};

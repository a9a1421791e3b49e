//! Frames as PNG. Does not know how they were drawn.

use std::io;
use std::path::Path;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder, ImageError};

use super::{WriteError, write_whole};

/// The file name of a frame, counted from 0: `frame_00012.png`.
pub fn numbered(frame: u32, extension: &str) -> String {
    format!("frame_{frame:05}.{extension}")
}

/// Writes an 8-bit sRGB image, rows from the top, `rgb.len() = 3 · width · height`.
pub fn write_png(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<(), WriteError> {
    check_rgb(path, width, height, rgb)?;
    write_whole(path, |file| {
        // Photographs shrink well by the fast setting and the simulation does not wait for the slow one.
        let encoder = PngEncoder::new_with_quality(file, CompressionType::Fast, FilterType::Adaptive);
        encoder.write_image(rgb, width, height, ExtendedColorType::Rgb8).map_err(|e| match e {
            ImageError::IoError(e) => e,
            e => io::Error::other(e),
        })
    })
}

/// Refuses an image whose bytes are not those of its size.
pub(super) fn check_rgb(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<(), WriteError> {
    let expected = 3 * u128::from(width) * u128::from(height);
    if expected == 0 || rgb.len() as u128 != expected {
        let what = format!("a frame of {width} × {height} has {expected} bytes of RGB, {} were given", rgb.len());
        return Err(WriteError::shape(path, what));
    }
    Ok(())
}

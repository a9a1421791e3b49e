//! Decoding what a user hands in: every reader returns plain arrays or a `ReadError`; none knows what they are for.
//!
//! The content of a file decides its format, never its name. Sizes a file announces are checked against limits and
//! against the bytes that are there before anything of that size is allocated.

mod error;
mod npy;
mod ply;

mod depth;
mod image;
mod mesh;
mod points;
mod roots;

pub use depth::{ScalarMap, read_scalar_map};
pub use error::ReadError;
pub use image::{ColorImage, LabelImage, read_color_image, read_label_image};
pub use mesh::{TriMesh, read_mesh};
pub use points::{PointSet, read_points};
pub use roots::AssetRoot;

use std::fs::{self, File};
use std::io::{BufReader, ErrorKind, Read, Seek};
use std::path::Path;

/// Most pixels an image or map may have: 128 Mi, an image of 16384 × 8192.
pub const MAX_PIXELS: u64 = 1 << 27;

/// Most points, vertices or triangles a file may hold.
pub const MAX_POINTS: u64 = 100_000_000;

/// Opens a regular file and says how long it is [bytes].
fn open(path: &Path) -> Result<(BufReader<File>, u64), ReadError> {
    let failed = |source: std::io::Error| match source.kind() {
        // A path through something that is not a folder is as missing as any other.
        ErrorKind::NotFound | ErrorKind::NotADirectory => ReadError::Missing { path: path.into() },
        _ => ReadError::Io { path: path.into(), source },
    };
    // Asked before opening: opening a named pipe would wait for its writer.
    let meta = fs::metadata(path).map_err(failed)?;
    if meta.is_dir() {
        return Err(ReadError::Folder { path: path.into() });
    }
    if !meta.is_file() {
        return Err(ReadError::format(path, "a regular file"));
    }
    let file = File::open(path).map_err(failed)?;
    Ok((BufReader::new(file), meta.len()))
}

/// The first `N` bytes (fewer at the end of a short file are zero), leaving the reader at the start.
fn first_bytes<const N: usize>(path: &Path, reader: &mut BufReader<File>) -> Result<[u8; N], ReadError> {
    let mut head = Vec::with_capacity(N);
    let failed = |source| ReadError::Io { path: path.into(), source };
    reader.by_ref().take(N as u64).read_to_end(&mut head).map_err(failed)?;
    reader.rewind().map_err(failed)?;
    let mut bytes = [0; N];
    bytes[..head.len()].copy_from_slice(&head);
    Ok(bytes)
}

/// Refuses an image of no or too many pixels; else its pixel count.
fn checked_pixels(path: &Path, width: u64, height: u64) -> Result<usize, ReadError> {
    let pixels = u128::from(width) * u128::from(height);
    if pixels == 0 {
        return Err(ReadError::damaged(path, format!("its size is {width} × {height} pixels")));
    }
    if pixels > u128::from(MAX_PIXELS) || width > u64::from(u32::MAX) || height > u64::from(u32::MAX) {
        let what = format!("announces {width} × {height} pixels");
        return Err(ReadError::TooLarge { path: path.into(), what, limit: format!("{MAX_PIXELS} pixels") });
    }
    Ok(pixels as usize)
}

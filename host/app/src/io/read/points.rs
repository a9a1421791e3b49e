//! Point sets from PLY and NPZ. Does not know what the points are used for.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use zip::ZipArchive;
use zip::result::ZipError;

use super::npy::{Dtype, NpyArray, read_npy};
use super::ply::read_ply;
use super::{MAX_POINTS, ReadError, first_bytes, open};

/// Points in the file's own units and axes; colours, when there are any, one a point, sRGB 0–1.
#[derive(Debug, Clone, PartialEq)]
pub struct PointSet {
    pub positions: Vec<[f32; 3]>,
    pub colors: Option<Vec<[f32; 3]>>,
}

/// How a file stores colours.
pub(super) enum RawColors {
    /// 0–255.
    Bytes,
    /// 0–1.
    Unit,
}

/// Reads a PLY (ascii or binary: vertices with `x y z` and optionally `red green blue`, uchar 0–255 or float 0–1) or
/// an NPZ (`positions` (N, 3) float32 or float64 and optionally `colors` (N, 3) uint8 0–255 or float 0–1). No points
/// and values that are not finite are refused.
pub fn read_points(path: &Path) -> Result<PointSet, ReadError> {
    let (mut reader, length) = open(path)?;
    match first_bytes::<4>(path, &mut reader)? {
        [b'p', b'l', b'y', b'\n' | b'\r' | b' '] => read_ply(path, reader, length),
        // The second is an archive with no files in it.
        [b'P', b'K', 3, 4] | [b'P', b'K', 5, 6] => read_npz(path, reader),
        _ => Err(ReadError::format(path, "a PLY or NPZ file")),
    }
}

fn read_npz(path: &Path, reader: BufReader<File>) -> Result<PointSet, ReadError> {
    let mut archive = ZipArchive::new(reader).map_err(|e| ReadError::damaged(path, e))?;
    let Some(positions) = array(path, &mut archive, "positions")? else {
        return Err(ReadError::content(path, "has no array named positions", "Save one of shape (N, 3)."));
    };
    if !matches!(positions.dtype, Dtype::F32 | Dtype::F64) {
        return Err(ReadError::unsupported(path, "positions are not floats", "Save them as float32."));
    }
    let positions = triples(path, "positions", &positions)?;
    let (colors, raw) = match array(path, &mut archive, "colors")? {
        None => (None, RawColors::Unit),
        Some(colors) => {
            let raw = match colors.dtype {
                Dtype::U8 => RawColors::Bytes,
                Dtype::F32 | Dtype::F64 => RawColors::Unit,
                _ => return Err(ReadError::unsupported(path, "colors are neither uint8 nor float", "Save uint8.")),
            };
            (Some(triples(path, "colors", &colors)?), raw)
        }
    };
    checked_points(path, positions, colors, raw)
}

fn array(path: &Path, archive: &mut ZipArchive<BufReader<File>>, name: &str) -> Result<Option<NpyArray>, ReadError> {
    let entry = match archive.by_name(&format!("{name}.npy")) {
        Ok(entry) => entry,
        Err(ZipError::FileNotFound) => return Ok(None),
        Err(ZipError::UnsupportedArchive(what)) => {
            return Err(ReadError::unsupported(path, what, "Save it with numpy.savez."));
        }
        Err(e) => return Err(ReadError::damaged(path, e)),
    };
    read_npy(path, name, entry, 3 * MAX_POINTS).map(Some)
}

fn triples(path: &Path, name: &str, array: &NpyArray) -> Result<Vec<[f32; 3]>, ReadError> {
    if !matches!(array.shape.as_slice(), [_, 3]) {
        let what = format!("{name} has the shape {:?}", array.shape);
        return Err(ReadError::content(path, what, "Save an array of shape (N, 3)."));
    }
    Ok(array.data.chunks_exact(3).map(|v| [v[0], v[1], v[2]]).collect())
}

/// Makes a point set of what a file held, or says which point cannot be used.
pub(super) fn checked_points(
    path: &Path,
    positions: Vec<[f32; 3]>,
    mut colors: Option<Vec<[f32; 3]>>,
    raw: RawColors,
) -> Result<PointSet, ReadError> {
    if positions.is_empty() {
        return Err(ReadError::content(path, "has no points", "Give at least one."));
    }
    if let Some(row) = positions.iter().position(|p| p.iter().any(|v| !v.is_finite())) {
        let what = format!("point {row} (counted from 0) is {:?}", positions[row]);
        return Err(ReadError::content(path, what, "Remove points that are not finite numbers."));
    }
    if let Some(colors) = &mut colors {
        if colors.len() != positions.len() {
            let what = format!("has {} colours for {} points", colors.len(), positions.len());
            return Err(ReadError::content(path, what, "Give one colour a point or none."));
        }
        if matches!(raw, RawColors::Bytes) {
            colors.iter_mut().flatten().for_each(|v| *v /= 255.0);
        }
        if let Some(row) = colors.iter().position(|c| c.iter().any(|v| !(0.0..=1.0).contains(v))) {
            let what = format!("the colour of point {row} (counted from 0) is {:?}", colors[row]);
            return Err(ReadError::content(path, what, "Float colours lie in 0–1; write 0–255 as bytes."));
        }
    }
    Ok(PointSet { positions, colors })
}

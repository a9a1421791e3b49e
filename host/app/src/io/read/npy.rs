//! One array from NumPy's NPY format. Does not know what the numbers mean.
//!
//! Read here and not by a library because the array must not be allocated before its announced size is known to be
//! allowed, and because a hostile header must not reach a recursive parser.

use std::io::Read;
use std::path::Path;

use super::ReadError;

/// An array in C order, values converted to `f32`.
#[derive(Debug)]
pub(super) struct NpyArray {
    pub dtype: Dtype,
    pub shape: Vec<usize>,
    pub data: Vec<f32>,
}

/// Number types that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Dtype {
    U8,
    U16,
    I32,
    I64,
    F32,
    F64,
}

impl Dtype {
    fn size(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U16 => 2,
            Self::I32 | Self::F32 => 4,
            Self::I64 | Self::F64 => 8,
        }
    }
}

/// Reads an array of at most `max_elements` numbers. `name` says in errors which array of the file it is.
pub(super) fn read_npy(
    path: &Path,
    name: &str,
    mut reader: impl Read,
    max_elements: u64,
) -> Result<NpyArray, ReadError> {
    let mut prefix = [0; 8];
    let cut = |what: &str| ReadError::damaged(path, format!("{name}: {what}"));
    reader.read_exact(&mut prefix).map_err(|e| cut(&e.to_string()))?;
    if !prefix.starts_with(b"\x93NUMPY") {
        return Err(cut("does not begin as an NPY array does"));
    }
    // Version 1 has a 16-bit header length, 2 and 3 have 32 bits.
    let mut length = [0; 4];
    let digits = if prefix[6] == 1 { 2 } else { 4 };
    reader.read_exact(&mut length[..digits]).map_err(|e| cut(&e.to_string()))?;
    let length = u32::from_le_bytes(length);
    if length > 1 << 16 {
        return Err(cut(&format!("its header announces {length} bytes")));
    }
    let mut header = vec![0; length as usize];
    reader.read_exact(&mut header).map_err(|e| cut(&e.to_string()))?;
    let header = String::from_utf8_lossy(&header);

    let descr =
        field(&header, "descr").and_then(quoted).ok_or_else(|| cut("its header names no simple number type"))?;
    let (dtype, big_endian) = dtype(descr).ok_or_else(|| {
        let what = format!("{name} holds numbers of type {descr:?}");
        ReadError::unsupported(path, what, "Save it as float32, float64, uint8, uint16, int32 or int64.")
    })?;
    let fortran = match field(&header, "fortran_order") {
        Some(v) if v.starts_with("False") => false,
        Some(v) if v.starts_with("True") => true,
        _ => return Err(cut("its header does not give the order of the values")),
    };
    let shape = field(&header, "shape").and_then(tuple).ok_or_else(|| cut("its header gives no shape"))?;
    let count = shape.iter().try_fold(1u64, |n, &d| n.checked_mul(d)).filter(|&n| n <= max_elements);
    let Some(count) = count else {
        let what = format!("{name} announces an array of {shape:?}");
        return Err(ReadError::TooLarge { path: path.into(), what, limit: format!("{max_elements} numbers") });
    };

    // Grows with the bytes that are really there.
    let expected = count * dtype.size() as u64;
    let mut bytes = Vec::new();
    reader.by_ref().take(expected).read_to_end(&mut bytes).map_err(|e| cut(&e.to_string()))?;
    if bytes.len() as u64 != expected {
        return Err(cut(&format!("{} of {expected} bytes of values are there", bytes.len())));
    }
    let shape: Vec<usize> = shape.into_iter().map(|d| d as usize).collect();
    let mut data = convert(&bytes, dtype, big_endian);
    if fortran && shape.len() == 2 {
        let (rows, cols) = (shape[0], shape[1]);
        data = (0..data.len()).map(|i| data[(i % cols) * rows + i / cols]).collect();
    } else if fortran && shape.len() > 2 {
        return Err(ReadError::unsupported(path, format!("{name} is in Fortran order"), "Save it in C order."));
    }
    Ok(NpyArray { dtype, shape, data })
}

/// What follows `'key':` in the header's dictionary.
fn field<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    let after = ['\'', '"'].into_iter().find_map(|q| header.split_once(&format!("{q}{key}{q}")))?.1;
    after.trim_start().strip_prefix(':').map(str::trim_start)
}

fn quoted(value: &str) -> Option<&str> {
    let quote = value.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    value[1..].split_once(quote).map(|(inner, _)| inner)
}

fn tuple(value: &str) -> Option<Vec<u64>> {
    let inner = value.strip_prefix('(')?.split_once(')')?.0;
    // A tuple of one ends with a comma: (5,).
    inner
        .trim()
        .trim_end_matches(',')
        .split(',')
        .filter(|s| !s.trim().is_empty())
        .map(|s| s.trim().parse().ok())
        .collect()
}

/// The number type of a NumPy type string such as `<f4`, and whether it is big-endian.
fn dtype(descr: &str) -> Option<(Dtype, bool)> {
    let (order, kind) = match descr.as_bytes().first()? {
        b'<' | b'|' | b'=' => (false, &descr[1..]),
        b'>' => (true, &descr[1..]),
        _ => (false, descr),
    };
    let dtype = match kind {
        "u1" => Dtype::U8,
        "u2" => Dtype::U16,
        "i4" => Dtype::I32,
        "i8" => Dtype::I64,
        "f4" => Dtype::F32,
        "f8" => Dtype::F64,
        _ => return None,
    };
    Some((dtype, order))
}

fn convert(bytes: &[u8], dtype: Dtype, big_endian: bool) -> Vec<f32> {
    /// `N` bytes in little-endian order.
    fn numbers<const N: usize>(bytes: &[u8], big_endian: bool) -> impl Iterator<Item = [u8; N]> + '_ {
        bytes.chunks_exact(N).map(move |chunk| {
            let mut number = [0; N];
            number.copy_from_slice(chunk);
            if big_endian {
                number.reverse();
            }
            number
        })
    }
    match dtype {
        Dtype::U8 => bytes.iter().map(|&b| f32::from(b)).collect(),
        Dtype::U16 => numbers(bytes, big_endian).map(|b| f32::from(u16::from_le_bytes(b))).collect(),
        Dtype::I32 => numbers(bytes, big_endian).map(|b| i32::from_le_bytes(b) as f32).collect(),
        Dtype::I64 => numbers(bytes, big_endian).map(|b| i64::from_le_bytes(b) as f32).collect(),
        Dtype::F32 => numbers(bytes, big_endian).map(f32::from_le_bytes).collect(),
        Dtype::F64 => numbers(bytes, big_endian).map(|b| f64::from_le_bytes(b) as f32).collect(),
    }
}

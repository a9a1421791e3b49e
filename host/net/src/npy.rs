//! NPY arrays of any rank and NPZ archives of them, from bytes that may be anything. Does not know what they mean.

use std::collections::BTreeMap;
use std::io::{Read, Seek};

use half::f16;

use crate::array::Plain;
use crate::tensor::count;

/// Most entries of an archive.
const MOST_ARRAYS: usize = 1000;

/// Reads every array of an archive, at most `most` bytes of numbers in all.
pub(crate) fn read_npz(file: impl Read + Seek, most: u64) -> Result<BTreeMap<String, Plain>, String> {
    let mut archive = zip::ZipArchive::new(file).map_err(|e| format!("is no NPZ archive: {e}"))?;
    if archive.len() > MOST_ARRAYS {
        return Err(format!("holds {} arrays, more than {MOST_ARRAYS}", archive.len()));
    }
    let mut left = most;
    let mut arrays = BTreeMap::new();
    for i in 0..archive.len() {
        let entry = archive.by_index(i).map_err(|e| format!("is damaged: {e}"))?;
        let name = entry.name().trim_end_matches(".npy").to_owned();
        let (array, bytes) = read_npy(entry, left).map_err(|why| format!("array {name} {why}"))?;
        left -= bytes;
        if arrays.insert(name.clone(), array).is_some() {
            return Err(format!("holds array {name} twice"));
        }
    }
    Ok(arrays)
}

/// Reads one array of at most `most` bytes, and says how many it had.
pub(crate) fn read_npy(mut reader: impl Read, most: u64) -> Result<(Plain, u64), String> {
    let header = header(&mut reader)?;
    let descr = field(&header, "descr").and_then(quoted).ok_or("names no simple number type")?;
    let (kind, big_endian) = match descr.as_bytes().first() {
        Some(b'>') => (&descr[1..], true),
        Some(b'<' | b'|' | b'=') => (&descr[1..], false),
        _ => (descr, false),
    };
    let size: u64 = match kind {
        "b1" | "u1" | "i1" => 1,
        "f2" | "i2" | "u2" => 2,
        "f4" | "i4" | "u4" => 4,
        "f8" | "i8" | "u8" => 8,
        _ => return Err(format!("holds numbers of type {descr:?}; save it as float32, float16, int64 or bool")),
    };
    if field(&header, "fortran_order").is_none_or(|v| !v.starts_with("False")) {
        return Err("is not in C order; save it with numpy.ascontiguousarray".into());
    }
    let shape = field(&header, "shape").and_then(tuple).ok_or("has no shape")?;
    let n = count(&shape).ok_or("has a shape that does not fit in memory")? as u64;
    let bytes = n * size;
    if bytes > most {
        return Err(format!("has {bytes} bytes, more than {most} that are left for it"));
    }
    // Grows with the bytes that are really there.
    let mut raw = Vec::new();
    reader.take(bytes).read_to_end(&mut raw).map_err(|e| format!("is damaged: {e}"))?;
    if raw.len() as u64 != bytes {
        return Err(format!("is cut short: {} of {bytes} bytes are there", raw.len()));
    }
    let data = raw.chunks_exact(size as usize).map(|chunk| number(kind, chunk, big_endian)).collect();
    Ok((Plain { shape, data }, bytes))
}

fn header(reader: &mut impl Read) -> Result<String, String> {
    let damaged = |e: std::io::Error| format!("is damaged: {e}");
    let mut prefix = [0; 8];
    reader.read_exact(&mut prefix).map_err(damaged)?;
    if !prefix.starts_with(b"\x93NUMPY") {
        return Err("does not begin as an NPY array does".into());
    }
    // Version 1 has a 16-bit header length, 2 and 3 have 32 bits.
    let mut length = [0; 4];
    let digits = if prefix[6] == 1 { 2 } else { 4 };
    reader.read_exact(&mut length[..digits]).map_err(damaged)?;
    let length = u32::from_le_bytes(length);
    if length > 1 << 16 {
        return Err(format!("announces a header of {length} bytes"));
    }
    let mut header = vec![0; length as usize];
    reader.read_exact(&mut header).map_err(damaged)?;
    Ok(String::from_utf8_lossy(&header).into_owned())
}

fn number(kind: &str, chunk: &[u8], big_endian: bool) -> f64 {
    let mut b = [0; 8];
    let n = chunk.len().min(8);
    b[..n].copy_from_slice(&chunk[..n]);
    if big_endian {
        b[..n].reverse();
    }
    let [b0, b1, b2, b3, ..] = b;
    match kind {
        "b1" => f64::from(u8::from(b0 != 0)),
        "u1" => f64::from(b0),
        "i1" => f64::from(b0 as i8),
        "f2" => f16::from_le_bytes([b0, b1]).to_f64(),
        "i2" => f64::from(i16::from_le_bytes([b0, b1])),
        "u2" => f64::from(u16::from_le_bytes([b0, b1])),
        "f4" => f64::from(f32::from_le_bytes([b0, b1, b2, b3])),
        "i4" => f64::from(i32::from_le_bytes([b0, b1, b2, b3])),
        "u4" => f64::from(u32::from_le_bytes([b0, b1, b2, b3])),
        "f8" => f64::from_le_bytes(b),
        // Token numbers and masks are far below 2^53.
        "i8" => i64::from_le_bytes(b) as f64,
        _ => u64::from_le_bytes(b) as f64,
    }
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

fn tuple(value: &str) -> Option<Vec<usize>> {
    let inner = value.strip_prefix('(')?.split_once(')')?.0;
    // A tuple of one ends with a comma: (5,).
    let numbers = inner.split(',').map(str::trim).filter(|s| !s.is_empty());
    let shape: Vec<usize> = numbers.map(|s| s.parse().ok()).collect::<Option<_>>()?;
    (shape.len() <= 16).then_some(shape)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend((header.len() as u16).to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    fn why(header: &str, data: &[u8]) -> String {
        read_npy(&npy(header, data)[..], 1 << 20).unwrap_err()
    }

    #[test]
    fn arrays_of_every_type_are_read() {
        let read = |descr: &str, shape: &str, data: &[u8]| {
            let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': {shape}, }}");
            read_npy(&npy(&header, data)[..], 1 << 20).unwrap().0
        };
        let array = read("<f4", "(2, 1)", &[1.5f32.to_le_bytes(), (-2.0f32).to_le_bytes()].concat());
        assert_eq!((array.shape, array.data), (vec![2, 1], vec![1.5, -2.0]));
        assert_eq!(read("<f2", "(1,)", &f16::from_f32(0.5).to_le_bytes()).data, [0.5]);
        assert_eq!(read(">i8", "()", &(-7i64).to_be_bytes()).data, [-7.0]);
        assert_eq!(read("|b1", "(3,)", &[0, 1, 2]).data, [0.0, 1.0, 1.0]);
        assert_eq!(read("<f8", "(0,)", &[]).data.len(), 0);
    }

    #[test]
    fn hostile_arrays_are_refused() {
        let good = "{'descr': '<f4', 'fortran_order': False, 'shape': (2,), }";
        assert!(why(good, &[0; 7]).contains("cut short"));
        assert!(why(&good.replace("(2,)", "(18446744073709551615, 2)"), &[]).contains("memory"));
        assert!(why(&good.replace("(2,)", "(1000000,)"), &[]).contains("bytes"));
        assert!(why(&good.replace("False", "True"), &[]).contains("C order"));
        assert!(why(&good.replace("<f4", "|O"), &[]).contains("type"));
        assert!(why(&good.replace("'<f4'", "[('a', '<f4')]"), &[]).contains("type"));
        assert!(why("{}", &[]).contains("type"));
        assert!(read_npy(&b"\x93NUMPY\x02\x00\xff\xff\xff\xff"[..], 10).unwrap_err().contains("header"));
        assert!(read_npy(&b"PK"[..], 10).unwrap_err().contains("damaged"));
        assert!(read_npz(std::io::Cursor::new(b"PK\x03\x04"), 10).is_err());
    }
}

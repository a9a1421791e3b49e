//! Particles of one frame as NPZ or PLY. Does not know what they are made of.

use std::io::{self, Write};
use std::path::Path;

use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, ZipWriter};

use super::{WriteError, write_whole};

/// Particles of one frame, in world axes.
#[derive(Debug, Clone, Copy, Default)]
pub struct PointFrame<'a> {
    /// (N, 3) [m].
    pub positions: &'a [[f32; 3]],
    /// (N, 3) [m/s].
    pub velocities: Option<&'a [[f32; 3]]>,
    /// (N, 3) sRGB 0–255.
    pub colors: Option<&'a [[u8; 3]]>,
    /// (N): object of each particle.
    pub ids: Option<&'a [u32]>,
}

impl PointFrame<'_> {
    fn check(&self, path: &Path) -> Result<(), WriteError> {
        let lengths = [
            ("velocities", self.velocities.map(<[_]>::len)),
            ("colors", self.colors.map(<[_]>::len)),
            ("ids", self.ids.map(<[_]>::len)),
        ];
        for (name, length) in lengths {
            if let Some(length) = length.filter(|&n| n != self.positions.len()) {
                let what = format!("{length} {name} were given for {} positions", self.positions.len());
                return Err(WriteError::shape(path, what));
            }
        }
        Ok(())
    }
}

/// Writes arrays `positions` (N, 3) float32 and, where given, `velocities` (N, 3) float32, `colors` (N, 3) uint8 and
/// `ids` (N) uint32, uncompressed, as `numpy.load` reads them. The same frame gives the same bytes.
pub fn write_npz(path: &Path, frame: &PointFrame) -> Result<(), WriteError> {
    frame.check(path)?;
    let rows = frame.positions.len();
    write_whole(path, |file| {
        let mut npz = ZipWriter::new(file);
        array(&mut npz, "positions", "<f4", &[rows, 3], frame.positions.iter().flatten().map(|v| v.to_le_bytes()))?;
        if let Some(velocities) = frame.velocities {
            array(&mut npz, "velocities", "<f4", &[rows, 3], velocities.iter().flatten().map(|v| v.to_le_bytes()))?;
        }
        if let Some(colors) = frame.colors {
            array(&mut npz, "colors", "|u1", &[rows, 3], colors.iter().flatten().map(|&v| [v]))?;
        }
        if let Some(ids) = frame.ids {
            array(&mut npz, "ids", "<u4", &[rows], ids.iter().map(|v| v.to_le_bytes()))?;
        }
        npz.finish()?;
        Ok(())
    })
}

fn array<const N: usize>(
    npz: &mut ZipWriter<impl Write + io::Seek>,
    name: &str,
    descr: &str,
    shape: &[usize],
    numbers: impl Iterator<Item = [u8; N]>,
) -> io::Result<()> {
    // A fixed date: the file is a function of its contents.
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .last_modified_time(DateTime::default())
        .large_file(shape.iter().product::<usize>() * N >= 1 << 31);
    npz.start_file(format!("{name}.npy"), options)?;
    let shape: String = shape.iter().map(|n| format!("{n}, ")).collect();
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}), }}", shape.trim_end());
    // The values begin at a multiple of 64 bytes and the header ends in a new line.
    let before = 10;
    header.push_str(&" ".repeat(63 - (before + header.len()) % 64));
    header.push('\n');
    npz.write_all(b"\x93NUMPY\x01\x00")?;
    npz.write_all(&(header.len() as u16).to_le_bytes())?;
    npz.write_all(header.as_bytes())?;
    write_numbers(npz, numbers)
}

/// Writes a binary little-endian PLY: vertices with `x y z` and, where given, `vx vy vz`, `red green blue` (uchar) and
/// `id` (uint).
pub fn write_ply(path: &Path, frame: &PointFrame) -> Result<(), WriteError> {
    frame.check(path)?;
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", frame.positions.len());
    let mut properties = |kind: &str, names: &[&str]| {
        for name in names {
            header.push_str(&format!("property {kind} {name}\n"));
        }
    };
    properties("float", &["x", "y", "z"]);
    if frame.velocities.is_some() {
        properties("float", &["vx", "vy", "vz"]);
    }
    if frame.colors.is_some() {
        properties("uchar", &["red", "green", "blue"]);
    }
    if frame.ids.is_some() {
        properties("uint", &["id"]);
    }
    header.push_str("end_header\n");
    write_whole(path, |file| {
        file.write_all(header.as_bytes())?;
        for (row, position) in frame.positions.iter().enumerate() {
            write_numbers(file, position.iter().map(|v| v.to_le_bytes()))?;
            if let Some(velocities) = frame.velocities {
                write_numbers(file, velocities[row].iter().map(|v| v.to_le_bytes()))?;
            }
            if let Some(colors) = frame.colors {
                file.write_all(&colors[row])?;
            }
            if let Some(ids) = frame.ids {
                file.write_all(&ids[row].to_le_bytes())?;
            }
        }
        Ok(())
    })
}

/// Numbers as bytes, gathered so that the writer below is not called for each.
fn write_numbers<const N: usize>(to: &mut impl Write, numbers: impl Iterator<Item = [u8; N]>) -> io::Result<()> {
    let mut buffer = Vec::with_capacity(1 << 12);
    for number in numbers {
        buffer.extend_from_slice(&number);
        if buffer.len() + N > 1 << 12 {
            to.write_all(&buffer)?;
            buffer.clear();
        }
    }
    to.write_all(&buffer)
}

//! Maps of one number a pixel (depth, disparity) from PNG, EXR, PFM and NPY. Does not know their unit.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use exr::prelude::{Compression, ReadChannels, ReadLayers};
use image::{DynamicImage, ImageFormat};

use super::image::{decode, png_kind};
use super::npy::read_npy;
use super::{MAX_PIXELS, ReadError, checked_pixels, first_bytes, open};

/// One number a pixel, rows from the top: `data.len() = width · height`. Unknown pixels are 0, all others are finite
/// and positive.
#[derive(Debug, Clone, PartialEq)]
pub struct ScalarMap {
    pub width: u32,
    pub height: u32,
    pub data: Vec<f32>,
}

/// Reads a greyscale PNG (8 or 16 bits), EXR (channel `Z`, else `depth`,
/// else `V` as Blender writes, else `Y`, else the only one), PFM or NPY (2-D).
/// Values are taken as stored; 0, negative and non-finite ones become 0 = unknown. A map without any known value is
/// refused.
pub fn read_scalar_map(path: &Path) -> Result<ScalarMap, ReadError> {
    let (mut reader, _) = open(path)?;
    let (width, height, mut data) = match first_bytes::<6>(path, &mut reader)? {
        [0x89, b'P', b'N', b'G', ..] => from_png(path, reader)?,
        [0x76, 0x2f, 0x31, 0x01, ..] => from_exr(path, reader)?,
        [b'P', b'f' | b'F', b, ..] if b.is_ascii_whitespace() => from_pfm(path, reader)?,
        [0x93, b'N', b'U', b'M', b'P', b'Y'] => from_npy(path, reader)?,
        _ => return Err(ReadError::format(path, "a PNG, EXR, PFM or NPY file")),
    };
    data.iter_mut().filter(|v| !(v.is_finite() && **v > 0.0)).for_each(|v| *v = 0.0);
    if data.iter().all(|&v| v == 0.0) {
        let what = "no pixel has a known value, all are zero, negative or not finite";
        return Err(ReadError::content(path, what, "Give a map with positive values."));
    }
    Ok(ScalarMap { width: width as u32, height: height as u32, data })
}

type Rows = (usize, usize, Vec<f32>);

fn from_png(path: &Path, mut reader: BufReader<File>) -> Result<Rows, ReadError> {
    let kind = png_kind(path, &mut reader)?;
    if !matches!(kind, Some((0, 8 | 16))) {
        let what = "a depth or disparity PNG has one channel of 8 or 16 bits, this one does not";
        return Err(ReadError::unsupported(path, what, "Save it as 16-bit greyscale."));
    }
    let image = decode(path, reader, ImageFormat::Png)?;
    let (width, height) = (image.width() as usize, image.height() as usize);
    let data = match image {
        DynamicImage::ImageLuma8(i) => i.into_raw().into_iter().map(f32::from).collect(),
        other => other.into_luma16().into_raw().into_iter().map(f32::from).collect(),
    };
    Ok((width, height, data))
}

fn from_npy(path: &Path, reader: BufReader<File>) -> Result<Rows, ReadError> {
    let array = read_npy(path, "the array", reader, MAX_PIXELS)?;
    let &[height, width] = array.shape.as_slice() else {
        let what = format!("the array has the shape {:?}, a map is (height, width)", array.shape);
        return Err(ReadError::unsupported(path, what, "Save a 2-D array."));
    };
    checked_pixels(path, width as u64, height as u64)?;
    Ok((width, height, array.data))
}

/// Portable float map: three lines `Pf`, `width height`, `scale`, then rows from the bottom. The sign of the scale is
/// the byte order (negative is little-endian); its size is a unit by convention and is ignored.
fn from_pfm(path: &Path, mut reader: BufReader<File>) -> Result<Rows, ReadError> {
    let mut words: Vec<String> = Vec::new();
    while words.len() < 4 {
        let mut line = Vec::new();
        let read = reader.by_ref().take(256).read_until(b'\n', &mut line);
        if read.map_err(|source| ReadError::Io { path: path.into(), source })? == 0 {
            return Err(ReadError::damaged(path, "its PFM header is incomplete"));
        }
        let line = String::from_utf8_lossy(&line);
        words.extend(line.split('#').take(1).flat_map(str::split_whitespace).map(str::to_owned));
    }
    if words[0] == "PF" {
        return Err(ReadError::unsupported(
            path,
            "is a colour PFM, a map has one channel",
            "Save it as Pf (greyscale).",
        ));
    }
    let (Ok(width), Ok(height), Ok(scale)) =
        (words[1].parse::<u32>(), words[2].parse::<u32>(), words[3].parse::<f32>())
    else {
        return Err(ReadError::damaged(path, "its PFM header is not valid"));
    };
    let pixels = checked_pixels(path, width.into(), height.into())?;
    let mut bytes = Vec::new();
    let read = reader.take(4 * pixels as u64).read_to_end(&mut bytes);
    read.map_err(|source| ReadError::Io { path: path.into(), source })?;
    if bytes.len() != 4 * pixels {
        return Err(ReadError::damaged(path, format!("{} of {} bytes of values are there", bytes.len(), 4 * pixels)));
    }
    let value = |b: &[u8]| {
        let b = [b[0], b[1], b[2], b[3]];
        if scale < 0.0 { f32::from_le_bytes(b) } else { f32::from_be_bytes(b) }
    };
    let (width, height) = (width as usize, height as usize);
    let data = bytes.chunks_exact(4 * width).rev().flat_map(|row| row.chunks_exact(4).map(value)).collect();
    Ok((width, height, data))
}

fn from_exr(path: &Path, reader: BufReader<File>) -> Result<Rows, ReadError> {
    let damaged = |e: exr::error::Error| match e {
        exr::error::Error::NotSupported(what) => {
            ReadError::unsupported(path, what, "Save it as a flat scan-line EXR with a Z channel.")
        }
        e => ReadError::damaged(path, e),
    };
    let chunks = exr::block::read(reader, true).map_err(damaged)?;
    for header in chunks.headers() {
        // The others are lossy, which depth does not bear, and their decoders trust what a damaged file says.
        use Compression::{PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
        if !matches!(header.compression, Uncompressed | RLE | ZIP1 | ZIP16 | PIZ | PXR24) {
            let what = format!("uses {}", header.compression);
            return Err(ReadError::unsupported(path, what, "Save it with ZIP compression."));
        }
        let size = header.layer_size;
        let channels = header.channels.list.len().max(1) as u64;
        // All channels of a layer are decoded, so all of them count.
        checked_pixels(path, size.width() as u64 * channels, size.height() as u64)?;
    }
    let image = exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(chunks)
        .map_err(damaged)?;
    let layer = image.layer_data;
    let (width, height) = (layer.size.width(), layer.size.height());
    let channels = layer.channel_data.list;
    let find = |wanted: &str| {
        // A channel of a named layer is called layer.channel.
        channels.iter().find(|c| c.name.to_string().rsplit('.').next().is_some_and(|n| n.eq_ignore_ascii_case(wanted)))
    };
    let channel = ["Z", "depth", "V", "Y"].into_iter().find_map(find).or(match channels.as_slice() {
        [only] => Some(only),
        _ => None,
    });
    let Some(channel) = channel else {
        let names: Vec<String> = channels.iter().map(|c| c.name.to_string()).collect();
        let what = format!("has none of the channels Z, depth, V and Y among {}", names.join(", "));
        return Err(ReadError::unsupported(path, what, "Name the depth channel Z."));
    };
    let data: Vec<f32> = channel.sample_data.values_as_f32().collect();
    if data.len() != width * height {
        let what = format!("channel {} does not have a value for every pixel", channel.name);
        return Err(ReadError::unsupported(path, what, "Save it without subsampling."));
    }
    Ok((width, height, data))
}

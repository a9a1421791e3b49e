//! Frames as OpenEXR: linear colour, depth, object id. Does not know how they were drawn.

use std::io;
use std::path::Path;

use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, Layer, LayerAttributes, LineOrder,
    WritableImage, f16,
};

use super::frames::check_rgb;
use super::{WriteError, write_whole};

/// A frame and its layers, rows from the top, `width · height` values each.
#[derive(Debug, Clone, Copy)]
pub struct ExrFrame<'a> {
    pub width: u32,
    pub height: u32,
    /// sRGB-encoded, three bytes a pixel; written linear as half-float `R`, `G`, `B`.
    pub rgb: &'a [u8],
    /// Depth along the view axis [m]; written as float `Z`.
    pub depth: Option<&'a [f32]>,
    /// Object of each pixel; written as integer `object_id`.
    pub object_id: Option<&'a [u32]>,
}

/// Writes a frame as one scan-line layer. The same frame gives the same bytes.
pub fn write_exr(path: &Path, frame: &ExrFrame) -> Result<(), WriteError> {
    check_rgb(path, frame.width, frame.height, frame.rgb)?;
    let pixels = frame.rgb.len() / 3;
    for (name, length) in [("depth", frame.depth.map(<[_]>::len)), ("object_id", frame.object_id.map(<[_]>::len))] {
        if let Some(length) = length.filter(|&n| n != pixels) {
            return Err(WriteError::shape(path, format!("{name} has {length} values for {pixels} pixels")));
        }
    }
    let linear: Vec<f16> = (0..=255u8).map(|v| f16::from_f32(linear_from_srgb(v))).collect();
    let mut channels: Vec<AnyChannel<FlatSamples>> = ["R", "G", "B"]
        .into_iter()
        .enumerate()
        .map(|(c, name)| {
            let values = frame.rgb.iter().skip(c).step_by(3).map(|&v| linear[usize::from(v)]).collect();
            AnyChannel::new(name, FlatSamples::F16(values))
        })
        .collect();
    channels.extend(frame.depth.map(|z| AnyChannel::new("Z", FlatSamples::F32(z.to_vec()))));
    channels.extend(frame.object_id.map(|id| AnyChannel::new("object_id", FlatSamples::U32(id.to_vec()))));

    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let size = (frame.width as usize, frame.height as usize);
    let layer =
        Layer::new(size, LayerAttributes::default(), encoding, AnyChannels::sort(channels.into_iter().collect()));
    let image = Image::from_layer(layer);
    // One thread: the order of blocks in the file must not depend on timing.
    write_whole(path, |file| {
        image.write().non_parallel().to_buffered(file).map_err(|e| match e {
            exr::error::Error::Io(e) => e,
            e => io::Error::other(e.to_string()),
        })
    })
}

/// IEC 61966-2-1.
fn linear_from_srgb(value: u8) -> f32 {
    let v = f32::from(value) / 255.0;
    if v <= 0.04045 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) }
}

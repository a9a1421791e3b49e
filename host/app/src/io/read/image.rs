//! Photographs and label images from PNG and JPEG. Does not know which pixels matter.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use image::{DynamicImage, ImageDecoder, ImageError, ImageFormat, ImageReader};

use super::{ReadError, checked_pixels, first_bytes, open};

/// A photograph, 8 bits a channel, sRGB-encoded, rows from the top: `rgb.len() = 3 · width · height`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColorImage {
    pub width: u32,
    pub height: u32,
    pub rgb: Vec<u8>,
}

/// Object labels, one byte a pixel, rows from the top: `labels.len() = width · height`; 0 is background.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct LabelImage {
    pub width: u32,
    pub height: u32,
    pub labels: Vec<u8>,
}

/// Colour types of a PNG header.
const PNG_GREY: u8 = 0;
const PNG_PALETTE: u8 = 3;

/// Reads a PNG or JPEG as 8-bit RGB: greys are spread, alpha is dropped, 16 bits are rounded to 8, and a JPEG is turned
/// upright as its EXIF orientation says (as viewers show it). Embedded colour profiles are not applied.
pub fn read_color_image(path: &Path) -> Result<ColorImage, ReadError> {
    let (mut reader, _) = open(path)?;
    let format = match first_bytes::<8>(path, &mut reader)? {
        [0x89, b'P', b'N', b'G', ..] => ImageFormat::Png,
        [0xff, 0xd8, 0xff, ..] => ImageFormat::Jpeg,
        _ => return Err(ReadError::format(path, "a PNG or JPEG image")),
    };
    if format == ImageFormat::Jpeg {
        refuse_cut_jpeg(path)?;
    }
    let image = decode(path, reader, format)?;
    let rgb = image.into_rgb8();
    Ok(ColorImage { width: rgb.width(), height: rgb.height(), rgb: rgb.into_raw() })
}

/// Reads labels from a greyscale PNG of at most 8 bits, as the raw values it stores (a 1-bit mask holds 0 and 1).
pub fn read_label_image(path: &Path) -> Result<LabelImage, ReadError> {
    const ADVICE: &str = "Save the labels as an 8-bit greyscale PNG whose grey values are the labels.";
    let (mut reader, _) = open(path)?;
    let (colour_type, bits) = match png_kind(path, &mut reader)? {
        Some(kind) => kind,
        None => match first_bytes::<3>(path, &mut reader)? {
            [0xff, 0xd8, 0xff] => return Err(ReadError::unsupported(path, "JPEG changes label values", ADVICE)),
            _ => return Err(ReadError::format(path, "a PNG image")),
        },
    };
    let what = match (colour_type, bits) {
        (PNG_GREY, ..=8) => None,
        (PNG_GREY, _) => Some("has 16 bits a pixel, labels have 8"),
        (PNG_PALETTE, _) => Some("has a colour palette, labels are grey values"),
        _ => Some("is a colour image, labels are grey values"),
    };
    if let Some(what) = what {
        return Err(ReadError::unsupported(path, what, ADVICE));
    }
    let luma = decode(path, reader, ImageFormat::Png)?.into_luma8();
    let (width, height) = luma.dimensions();
    let mut labels = luma.into_raw();
    // The decoder spreads 1, 2 and 4 bits over 0–255; the stored value is what was meant.
    let step = 255 / ((1u16 << bits) - 1);
    if step > 1 {
        labels.iter_mut().for_each(|v| *v = (u16::from(*v) / step) as u8);
    }
    Ok(LabelImage { width, height, labels })
}

/// Colour type and bits a channel from a PNG header; `None` if it is no PNG.
pub(super) fn png_kind(path: &Path, reader: &mut BufReader<File>) -> Result<Option<(u8, u8)>, ReadError> {
    let head = first_bytes::<26>(path, reader)?;
    if !head.starts_with(b"\x89PNG\r\n\x1a\n") {
        return Ok(None);
    }
    let (bits, colour_type) = (head[24], head[25]);
    if &head[12..16] != b"IHDR" || !matches!(bits, 1 | 2 | 4 | 8 | 16) {
        return Err(ReadError::damaged(path, "its PNG header is not valid"));
    }
    Ok(Some((colour_type, bits)))
}

/// The decoder fills what is missing of a JPEG with grey. A whole one has its end marker (FF D9) after the start of its
/// last scan (FF DA); the data between holds neither, since every FF in it is followed by a zero or a restart marker.
fn refuse_cut_jpeg(path: &Path) -> Result<(), ReadError> {
    let bytes = std::fs::read(path).map_err(|e| ReadError::damaged(path, e))?;
    let last = |marker: u8| bytes.windows(2).rposition(|w| w == [0xff, marker]);
    match (last(0xda), last(0xd9)) {
        (Some(scan), Some(end)) if end > scan => Ok(()),
        _ => Err(ReadError::damaged(path, "it ends before its image does")),
    }
}

/// Decodes an image of an allowed size.
pub(super) fn decode(path: &Path, reader: BufReader<File>, format: ImageFormat) -> Result<DynamicImage, ReadError> {
    let failed = |e: ImageError| match e {
        ImageError::IoError(source) if source.kind() != std::io::ErrorKind::UnexpectedEof => {
            ReadError::damaged(path, source)
        }
        ImageError::Unsupported(e) => ReadError::unsupported(path, e, "Save it as an ordinary 8-bit PNG or JPEG."),
        e => ReadError::damaged(path, e),
    };
    let mut decoder = ImageReader::with_format(reader, format).into_decoder().map_err(failed)?;
    let (width, height) = decoder.dimensions();
    checked_pixels(path, width.into(), height.into())?;
    let orientation = decoder.orientation().map_err(failed)?;
    let mut image = DynamicImage::from_decoder(decoder).map_err(failed)?;
    image.apply_orientation(orientation);
    Ok(image)
}

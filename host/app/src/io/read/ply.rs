//! The vertices of a PLY file. Does not read faces or any other element.

use std::fs::File;
use std::io::BufReader;
use std::path::Path;

use ply_rs_bw::parser::{Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType,
};

use super::points::{PointSet, RawColors, checked_points};
use super::{MAX_POINTS, ReadError};

const POSITION: [&str; 3] = ["x", "y", "z"];
const COLOR: [&str; 3] = ["red", "green", "blue"];

/// Reads `x y z` and, where there are all three, `red green blue` of the element `vertex`.
pub(super) fn read_ply(path: &Path, reader: BufReader<File>, length: u64) -> Result<PointSet, ReadError> {
    let mut reader = Reader::new(reader);
    let header = Parser::<Vertex>::new()
        .read_header(&mut reader)
        .map_err(|e| ReadError::damaged(path, one_line(&e.to_string())))?;
    check_counts(path, &header, length)?;
    for element in header.elements.values() {
        if element.name != "vertex" {
            let skipped = Parser::<Skipped>::new().read_payload_for_element(&mut reader, element, &header);
            skipped.map_err(|e| ReadError::damaged(path, one_line(&e.to_string())))?;
            continue;
        }
        let has = |names: [&str; 3]| names.iter().all(|&n| element.properties.contains_key(n));
        if !has(POSITION) {
            let what = "its vertices have no x, y and z";
            return Err(ReadError::content(path, what, "Write them as float properties named x, y and z."));
        }
        let colored = has(COLOR);
        let bytes = colored && color_is_byte(path, element)?;
        let vertices = Parser::<Vertex>::new()
            .read_payload_for_element(&mut reader, element, &header)
            .map_err(|e| ReadError::damaged(path, one_line(&e.to_string())))?;
        let positions = vertices.iter().map(|v| v.position).collect();
        let colors = colored.then(|| vertices.iter().map(|v| v.color).collect());
        return checked_points(path, positions, colors, if bytes { RawColors::Bytes } else { RawColors::Unit });
    }
    Err(ReadError::content(path, "has no element named vertex", "Write the points as vertices."))
}

/// Refuses element counts that the file cannot hold, before anything is read by them.
fn check_counts(path: &Path, header: &Header, length: u64) -> Result<(), ReadError> {
    let mut needed: u128 = 0;
    for element in header.elements.values() {
        let least: u128 = match header.encoding {
            // At least a digit and a separator each.
            Encoding::Ascii => 2 * element.properties.len() as u128,
            _ => element.properties.values().map(|p| least_bytes(&p.data_type)).sum(),
        };
        if least == 0 && element.count > 0 {
            return Err(ReadError::damaged(path, format!("element {} has no properties", element.name)));
        }
        needed += least * element.count as u128;
        // Too short for what is announced is plainer than too large.
        if needed > u128::from(length) + 1 {
            let what =
                format!("{} of {} need at least {needed} bytes, the file has {length}", element.count, element.name);
            return Err(ReadError::damaged(path, what));
        }
        if element.count as u64 > MAX_POINTS {
            let what = format!("announces {} of {}", element.count, element.name);
            return Err(ReadError::TooLarge { path: path.into(), what, limit: MAX_POINTS.to_string() });
        }
    }
    Ok(())
}

fn least_bytes(kind: &PropertyType) -> u128 {
    match kind {
        PropertyType::Scalar(scalar) | PropertyType::List(scalar, _) => match scalar {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    }
}

/// Whether colours are 0–255 (else 0–1); other kinds are refused.
fn color_is_byte(path: &Path, element: &ElementDef) -> Result<bool, ReadError> {
    let kinds = COLOR.map(|n| element.properties.get(n).map(|p| &p.data_type));
    let all =
        |wanted: fn(&ScalarType) -> bool| kinds.iter().all(|k| matches!(k, Some(PropertyType::Scalar(s)) if wanted(s)));
    if all(|s| matches!(s, ScalarType::UChar)) {
        Ok(true)
    } else if all(|s| matches!(s, ScalarType::Float | ScalarType::Double)) {
        Ok(false)
    } else {
        let what = "its colours are neither all uchar nor all float";
        Err(ReadError::unsupported(path, what, "Write red, green and blue as uchar."))
    }
}

/// The parser reports over several lines.
fn one_line(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(300).collect()
}

struct Vertex {
    position: [f32; 3],
    color: [f32; 3],
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self { position: [0.0; 3], color: [0.0; 3] }
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let slot = if let Some(i) = POSITION.iter().position(|&n| n == name) {
            &mut self.position[i]
        } else if let Some(i) = COLOR.iter().position(|&n| n == name) {
            &mut self.color[i]
        } else {
            return PropertyAccessResult::Ignored;
        };
        *slot = match property {
            Property::Char(v) => f32::from(v),
            Property::UChar(v) => f32::from(v),
            Property::Short(v) => f32::from(v),
            Property::UShort(v) => f32::from(v),
            Property::Int(v) => v as f32,
            Property::UInt(v) => v as f32,
            Property::Float(v) => v,
            Property::Double(v) => v as f32,
            _ => return PropertyAccessResult::UnsupportedType,
        };
        PropertyAccessResult::Set
    }
}

/// An element that is only stepped over.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

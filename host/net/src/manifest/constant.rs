//! Shapes and constants in a manifest. Knows no other input.

use super::inputs::Source;
use super::keys::{Item, Keys};
use super::parse::path;
use crate::tensor::count;

/// Most numbers of a constant in the manifest itself.
const LARGEST_CONSTANT: usize = 1 << 20;

pub(super) fn shape(item: &Item<'_>) -> Option<Vec<usize>> {
    let shape = item.sizes(0..=1 << 32)?;
    if shape.len() > 8 || count(&shape).is_none_or(|n| n > 1 << 32) {
        item.problem("is no shape of a tensor that fits in memory");
        return None;
    }
    Some(shape)
}

pub(super) fn constant(item: &Item<'_>, keys: &mut Keys<'_>) -> Option<Source> {
    let (value, shape_item, file) = (keys.get("value"), keys.get("shape"), keys.get("file"));
    match (value, file) {
        (None, Some(file)) => {
            if let Some(shape) = shape_item {
                shape.problem("a file brings its own shape");
            }
            Some(Source::ConstantFile { file: path(&file)? })
        }
        (Some(value), None) => {
            let values = if value.is_list() { value.numbers()? } else { vec![value.number()?] };
            let usual = if value.is_list() { vec![values.len()] } else { Vec::new() };
            let shape = shape_item.map_or(Some(usual), |i| shape(&i))?;
            let wanted = count(&shape).filter(|&n| n <= LARGEST_CONSTANT);
            match wanted {
                None => value.problem("is too large for a manifest: use `file`"),
                Some(n) if n != values.len() && value.is_list() => {
                    value.problem(format!("has {} entries, and its shape {n}", values.len()));
                    return None;
                }
                _ => {}
            }
            wanted.map(|_| Source::Constant { shape, values })
        }
        _ => {
            item.problem("a constant has either `value` or `file`");
            None
        }
    }
}

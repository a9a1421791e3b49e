//! Where things stand in a scene text: key path to byte range, byte to line and column. Knows no rule of the scene.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Byte ranges of key paths such as `object[1].source.mesh.file`; of the nearest ancestor where the key is absent.
pub(super) fn spans_of<'a>(text: &str, keys: impl Iterator<Item = &'a str>) -> Vec<Range<usize>> {
    let (document, _) = DeTable::parse_recoverable(text);
    keys.map(|key| span_of(&document, key)).collect()
}

/// Byte range of one key path in a parsed document.
pub(super) fn span_of(document: &Spanned<DeTable<'_>>, key: &str) -> Range<usize> {
    let mut best = 0..0;
    let mut table = document.get_ref();
    for step in key.split('.') {
        let mut parts = step.split('[');
        let name = parts.next().unwrap_or_default();
        let Some((key, mut value)) = table.get_key_value(name) else { return best };
        best = visible(value, key.span());
        for index in parts {
            let index = index.trim_end_matches(']').parse::<usize>().ok();
            let Some(item) = index.and_then(|index| value.get_ref().get(index)) else { return best };
            best = visible(item, best);
            value = item;
        }
        match value.get_ref() {
            DeValue::Table(inner) => table = inner,
            _ => return best,
        }
    }
    best
}

// Tables that only dotted keys or deeper headers imply have no text of their own: point at the key then.
fn visible(value: &Spanned<DeValue<'_>>, key: Range<usize>) -> Range<usize> {
    if value.span().is_empty() { key } else { value.span() }
}

/// Line and column of a byte, both from 1, the column in characters. Past the end means the end.
pub(super) fn place_of(text: &str, byte: usize) -> (usize, usize) {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    let before = &text[..byte];
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[start..].chars().count() + 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "seed = 1\n[[object]]\nname = 'é' # é\nsource.ball = { center = [0, 1, 2], radius = 1 }\n";

    fn found(key: &str) -> &str {
        &TEXT[spans_of(TEXT, std::iter::once(key)).remove(0)]
    }

    #[test]
    fn a_key_path_leads_to_its_value() {
        assert_eq!(found("seed"), "1");
        assert_eq!(found("object[0].name"), "'é'");
        assert_eq!(found("object[0].source.ball.center[1]"), "1");
        assert_eq!(found("object[0].source.ball.radius"), "1");
        assert_eq!(found("object[0]"), "[[object]]");
    }

    #[test]
    fn an_absent_key_leads_to_its_nearest_ancestor() {
        assert_eq!(found("object[0].density"), "[[object]]");
        assert_eq!(found("object[7].density"), "[[object]]");
        assert_eq!(found("seed.deeper[1]"), "1");
        assert_eq!(found("nothing"), "");
        assert_eq!(found(""), "");
    }

    #[test]
    fn columns_count_characters() {
        let comment = TEXT.find('#').unwrap();
        assert_eq!(place_of(TEXT, comment), (3, 12));
        assert_eq!(place_of(TEXT, 0), (1, 1));
        assert_eq!(place_of(TEXT, usize::MAX), (5, 1));
        let inside = TEXT.find('é').unwrap() + 1;
        assert_eq!(place_of(TEXT, inside), (3, 9));
    }
}

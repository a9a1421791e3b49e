//! Reads a TOML document key by key and remembers everything that is wrong, each with its place. Knows no manifest.

use std::cell::RefCell;
use std::fmt;
use std::ops::Range;

use thiserror::Error;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// One thing that is wrong.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    /// Line, from 1.
    pub line: usize,
    /// Column in characters, from 1.
    pub column: usize,
    /// Key path such as `velocity.inputs[1].dtype`; empty for the whole text.
    pub key: String,
    /// What is wrong.
    pub message: String,
}

/// Everything that is wrong with one manifest, in the order of its text.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub struct ManifestErrors {
    /// Name of the file.
    pub file: String,
    /// At least one.
    pub problems: Vec<Problem>,
}

impl fmt::Display for ManifestErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, p) in self.problems.iter().enumerate() {
            let end = if i == 0 { "" } else { "\n" };
            write!(f, "{end}{}:{}:{}: ", self.file, p.line, p.column)?;
            if !p.key.is_empty() {
                write!(f, "{}: ", p.key)?;
            }
            f.write_str(&p.message)?;
        }
        Ok(())
    }
}

/// What was found wrong so far.
#[derive(Debug, Default)]
pub(super) struct Found(RefCell<Vec<(Range<usize>, String, String)>>);

impl Found {
    pub fn add(&self, span: Range<usize>, key: &str, message: impl Into<String>) {
        self.0.borrow_mut().push((span, key.to_owned(), message.into()));
    }

    pub fn into_errors(self, text: &str, file: &str) -> Option<ManifestErrors> {
        let mut found = self.0.into_inner();
        found.sort_by_key(|(span, ..)| span.start);
        let problem = |(span, key, message): (Range<usize>, String, String)| {
            let (line, column) = place_of(text, span.start);
            Problem { line, column, key, message }
        };
        let problems: Vec<_> = found.into_iter().map(problem).collect();
        (!problems.is_empty()).then(|| ManifestErrors { file: file.to_owned(), problems })
    }
}

/// Line and column of a byte, both from 1, the column in characters.
fn place_of(text: &str, byte: usize) -> (usize, usize) {
    let mut byte = byte.min(text.len());
    while !text.is_char_boundary(byte) {
        byte -= 1;
    }
    let before = &text[..byte];
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (before.matches('\n').count() + 1, before[start..].chars().count() + 1)
}

/// A value and where it stands.
#[derive(Clone)]
pub(super) struct Item<'a> {
    value: &'a DeValue<'a>,
    span: Range<usize>,
    path: String,
    found: &'a Found,
}

/// A table being read. What was not asked for by the time it is dropped is reported as unknown.
pub(super) struct Keys<'a> {
    table: &'a DeTable<'a>,
    span: Range<usize>,
    path: String,
    asked: Vec<&'static str>,
    given_up: bool,
    found: &'a Found,
}

impl<'a> Keys<'a> {
    /// The whole document.
    pub fn root(document: &'a Spanned<DeTable<'a>>, found: &'a Found) -> Self {
        Self { table: document.get_ref(), span: 0..0, path: String::new(), asked: Vec::new(), given_up: false, found }
    }

    /// The value of a key, if it is there.
    pub fn get(&mut self, key: &'static str) -> Option<Item<'a>> {
        self.asked.push(key);
        let (name, value) = self.table.get_key_value(key)?;
        // Tables that only headers imply have no text of their own: point at the key then.
        let span = if value.span().is_empty() { name.span() } else { value.span() };
        Some(Item { value: value.get_ref(), span, path: self.path_of(key), found: self.found })
    }

    /// The value of a key that must be there.
    pub fn need(&mut self, key: &'static str) -> Option<Item<'a>> {
        let item = self.get(key);
        if item.is_none() {
            self.problem(format!("`{key}` is missing"));
        }
        item
    }

    /// Takes back that unknown keys are reported: a reader gave up before it knew which keys belong here.
    pub fn give_up(&mut self) {
        self.given_up = true;
    }

    /// Reports something about the table as a whole.
    pub fn problem(&self, message: impl Into<String>) {
        self.found.add(self.span.clone(), &self.path, message);
    }

    fn path_of(&self, key: &str) -> String {
        if self.path.is_empty() { key.to_owned() } else { format!("{}.{key}", self.path) }
    }
}

impl Drop for Keys<'_> {
    fn drop(&mut self) {
        for name in self.table.keys() {
            let text: &str = name.get_ref();
            if !self.given_up && !self.asked.contains(&text) {
                let message = format!("unknown key `{text}`{}", nearest(text, &self.asked));
                self.found.add(name.span(), &self.path_of(text), message);
            }
        }
    }
}

/// `; did you mean …?`, where something known is near.
fn nearest(name: &str, known: &[&str]) -> String {
    let best = known.iter().map(|k| (strsim::osa_distance(name, k), *k)).min();
    match best {
        Some((distance, k)) if distance <= 1 + name.chars().count() / 4 => format!("; did you mean `{k}`?"),
        _ => format!("; known here: {}", known.join(", ")),
    }
}

impl<'a> Item<'a> {
    pub fn problem(&self, message: impl Into<String>) {
        self.found.add(self.span.clone(), &self.path, message);
    }

    fn wrong<T>(&self, expected: &str) -> Option<T> {
        self.problem(format!("expected {expected}, found {}", kind(self.value)));
        None
    }
    pub fn is_list(&self) -> bool {
        matches!(self.value, DeValue::Array(_))
    }

    pub fn is_text(&self) -> bool {
        matches!(self.value, DeValue::String(_))
    }

    pub fn text(&self) -> Option<String> {
        match self.value {
            DeValue::String(s) if !s.trim().is_empty() && !s.contains('\0') => Some(s.to_string()),
            DeValue::String(_) => {
                self.problem("is empty");
                None
            }
            _ => self.wrong("a text"),
        }
    }

    pub fn flag(&self) -> Option<bool> {
        match self.value {
            DeValue::Boolean(b) => Some(*b),
            _ => self.wrong("true or false"),
        }
    }

    /// A finite number.
    pub fn number(&self) -> Option<f64> {
        let value = match self.value {
            DeValue::Integer(i) => i64::from_str_radix(i.as_str(), i.radix()).ok().map(|i| i as f64),
            DeValue::Float(f) => f.as_str().parse().ok(),
            _ => return self.wrong("a number"),
        };
        let finite = value.filter(|v: &f64| v.is_finite());
        if finite.is_none() {
            self.problem("is not a finite number");
        }
        finite
    }

    /// A finite number for which `holds`; `must` says what that is.
    pub fn number_that(&self, must: &str, holds: impl Fn(f64) -> bool) -> Option<f64> {
        let value = self.number()?;
        if holds(value) {
            return Some(value);
        }
        self.problem(format!("must be {must}, is {value}"));
        None
    }

    /// A whole number in a range.
    pub fn whole(&self, range: std::ops::RangeInclusive<u64>) -> Option<u64> {
        let DeValue::Integer(i) = self.value else { return self.wrong("a whole number") };
        let value = u64::from_str_radix(i.as_str().trim_start_matches('+'), i.radix()).ok();
        let inside = value.filter(|v| range.contains(v));
        if inside.is_none() {
            self.problem(format!("must lie between {} and {}, is {}", range.start(), range.end(), i.as_str()));
        }
        inside
    }

    pub fn size(&self, range: std::ops::RangeInclusive<u64>) -> Option<usize> {
        self.whole(range).and_then(|v| usize::try_from(v).ok())
    }

    pub fn choice<T: Copy>(&self, choices: &[(&'static str, T)]) -> Option<T> {
        let name = self.text()?;
        let chosen = choices.iter().find(|(known, _)| *known == name).map(|(_, value)| *value);
        if chosen.is_none() {
            let known: Vec<_> = choices.iter().map(|(known, _)| *known).collect();
            self.problem(format!("`{name}` is not one of {}", known.join(", ")));
        }
        chosen
    }

    pub fn table(&self) -> Option<Keys<'a>> {
        let DeValue::Table(table) = self.value else { return self.wrong("a table") };
        let (span, path, found) = (self.span.clone(), self.path.clone(), self.found);
        Some(Keys { table, span, path, asked: Vec::new(), given_up: false, found })
    }

    pub fn list(&self) -> Option<Vec<Item<'a>>> {
        let DeValue::Array(list) = self.value else { return self.wrong("a list") };
        let item = |(i, value): (usize, &'a Spanned<DeValue<'a>>)| {
            let span = if value.span().is_empty() { self.span.clone() } else { value.span() };
            Item { value: value.get_ref(), span, path: format!("{}[{i}]", self.path), found: self.found }
        };
        Some(list.iter().enumerate().map(item).collect())
    }

    /// A list of finite numbers.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        self.list()?.iter().map(Item::number).collect()
    }

    /// A list of whole numbers.
    pub fn sizes(&self, range: std::ops::RangeInclusive<u64>) -> Option<Vec<usize>> {
        self.list()?.iter().map(|item| item.size(range.clone())).collect()
    }

    /// A list of `N` values.
    pub fn exactly<T, const N: usize>(&self, values: Option<Vec<T>>) -> Option<[T; N]> {
        let values = values?;
        let n = values.len();
        let array = values.try_into().ok();
        if array.is_none() {
            self.problem(format!("must have {N} entries, has {n}"));
        }
        array
    }
}

fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a text",
        DeValue::Integer(_) | DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

//! What is wrong with a scene and where, for terminals with and without colour. Knows no rule of the scene itself.

use std::fmt;
use std::ops::Range;
use std::sync::Arc;

use miette::{Diagnostic, LabeledSpan, NamedSource, SourceCode, SourceSpan};

use super::locate::place_of;

/// Sort of problem; each has a stable code that tools can match.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Kind {
    /// The text is not TOML.
    Syntax,
    /// A key that means nothing there.
    UnknownKey,
    /// A required key is absent.
    MissingKey,
    /// A value of another type.
    WrongType,
    /// A name that is not one of the choices.
    UnknownChoice,
    /// A number or text outside its physical range, NaN and Inf included.
    OutOfRange,
    /// Two things with one name or label.
    Duplicate,
    /// A reference to an object that is not there.
    UnknownObject,
    /// Two parts of the scene that exclude or lack each other.
    Conflict,
    /// A path that leaves the asset root, or a file that cannot be used.
    Path,
    /// More particles than memory can hold.
    Memory,
}

impl Kind {
    /// The stable code, such as `scene::unknown_key`.
    pub fn code(self) -> &'static str {
        match self {
            Kind::Syntax => "scene::syntax",
            Kind::UnknownKey => "scene::unknown_key",
            Kind::MissingKey => "scene::missing_key",
            Kind::WrongType => "scene::wrong_type",
            Kind::UnknownChoice => "scene::unknown_choice",
            Kind::OutOfRange => "scene::out_of_range",
            Kind::Duplicate => "scene::duplicate",
            Kind::UnknownObject => "scene::unknown_object",
            Kind::Conflict => "scene::conflict",
            Kind::Path => "scene::path",
            Kind::Memory => "scene::memory",
        }
    }

    fn label(self) -> &'static str {
        match self {
            Kind::Syntax | Kind::Path | Kind::Conflict | Kind::Memory => "here",
            Kind::UnknownKey | Kind::UnknownChoice => "not known here",
            Kind::MissingKey => "incomplete",
            Kind::WrongType => "wrong type",
            Kind::OutOfRange => "out of range",
            Kind::Duplicate => "used twice",
            Kind::UnknownObject => "no such object",
        }
    }
}

/// What is wrong at a key, before it is known where the key stands in the text.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Problem {
    pub kind: Kind,
    /// Key path such as `object[1].source.mesh.file`; lists count from 0; empty for the whole text.
    pub key: String,
    /// What is wrong, without the place.
    pub message: String,
    /// What to do about it.
    pub help: Option<String>,
}

impl Problem {
    /// A problem without advice.
    pub fn new(kind: Kind, key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { kind, key: key.into(), message: message.into(), help: None }
    }

    /// The same with advice on what to do.
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// One problem and its place in the text. Displays as one line without the place, which miette draws itself.
#[derive(Debug, Clone)]
pub struct SceneError {
    problem: Problem,
    span: Range<usize>,
    line: usize,
    column: usize,
    source: Arc<NamedSource<String>>,
}

impl SceneError {
    /// What is wrong.
    pub fn problem(&self) -> &Problem {
        &self.problem
    }

    /// Byte range in the scene text.
    pub fn span(&self) -> Range<usize> {
        self.span.clone()
    }

    /// `file:line:column`, counted from 1, columns in characters.
    pub fn place(&self) -> String {
        format!("{}:{}:{}", self.source.name(), self.line, self.column)
    }
}

impl fmt::Display for SceneError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.problem.key.is_empty() {
            write!(f, "{}: ", self.problem.key)?;
        }
        f.write_str(&self.problem.message)
    }
}

impl std::error::Error for SceneError {}

impl Diagnostic for SceneError {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new(self.problem.kind.code()))
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.problem.help.as_ref().map(|help| Box::new(help) as Box<dyn fmt::Display>)
    }

    fn source_code(&self) -> Option<&dyn SourceCode> {
        Some(&self.source)
    }

    fn labels(&self) -> Option<Box<dyn Iterator<Item = LabeledSpan> + '_>> {
        let span = SourceSpan::from((self.span.start, self.span.len()));
        let label = LabeledSpan::new_with_span(Some(self.problem.kind.label().to_owned()), span);
        Some(Box::new(std::iter::once(label)))
    }
}

/// Every problem of a scene, in the order of the text.
///
/// `Display` is the whole report as plain text, with `file:line:column`, key path, code and help of each problem. For
/// a terminal with colour, hand each of [`SceneErrors::iter`] (or the whole, whose problems are related diagnostics)
/// to a miette handler.
#[derive(Debug, Clone)]
pub struct SceneErrors {
    file_name: String,
    errors: Vec<SceneError>,
}

impl SceneErrors {
    /// Places problems found later (a missing file, a mask of another size) at their keys in the scene text.
    pub fn locate(text: &str, file_name: &str, problems: Vec<Problem>) -> Self {
        let spans = super::locate::spans_of(text, problems.iter().map(|problem| problem.key.as_str()));
        Self::at(text, file_name, problems.into_iter().zip(spans).collect())
    }

    /// Problems whose byte ranges are known.
    pub(super) fn at(text: &str, file_name: &str, mut found: Vec<(Problem, Range<usize>)>) -> Self {
        found.sort_by_key(|(_, span)| (span.start, span.end));
        let source = Arc::new(NamedSource::new(file_name, text.to_owned()).with_language("TOML"));
        let errors = found
            .into_iter()
            .map(|(problem, span)| {
                let (line, column) = place_of(text, span.start);
                SceneError { problem, span, line, column, source: Arc::clone(&source) }
            })
            .collect();
        Self { file_name: file_name.to_owned(), errors }
    }

    /// The problems, in the order of the text.
    pub fn iter(&self) -> std::slice::Iter<'_, SceneError> {
        self.errors.iter()
    }

    /// How many there are.
    pub fn len(&self) -> usize {
        self.errors.len()
    }

    /// True when there is none, which only an empty list given to [`SceneErrors::locate`] makes.
    pub fn is_empty(&self) -> bool {
        self.errors.is_empty()
    }
}

impl<'a> IntoIterator for &'a SceneErrors {
    type Item = &'a SceneError;
    type IntoIter = std::slice::Iter<'a, SceneError>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

impl fmt::Display for SceneErrors {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let count = self.errors.len();
        write!(f, "{}: {count} {}", self.file_name, if count == 1 { "problem" } else { "problems" })?;
        for error in &self.errors {
            write!(f, "\n{}: {error} ({})", error.place(), error.problem.kind.code())?;
            if let Some(help) = &error.problem.help {
                write!(f, "\n  help: {help}")?;
            }
        }
        Ok(())
    }
}

impl std::error::Error for SceneErrors {}

impl Diagnostic for SceneErrors {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        Some(Box::new("scene"))
    }

    fn related<'a>(&'a self) -> Option<Box<dyn Iterator<Item = &'a dyn Diagnostic> + 'a>> {
        Some(Box::new(self.errors.iter().map(|error| error as &dyn Diagnostic)))
    }
}

//! Scene text to a checked scene, or to every problem it has. Opens no file: paths are only looked at as text.

use serde::Deserialize;
use toml::Spanned;
use toml::de::{DeTable, Deserializer};

use super::errors::{Kind, Problem, SceneErrors};
use super::locate::{place_of, span_of};
use super::{Scene, rules, structure};

/// Most problems reported of a text that is not TOML.
const SYNTAX_PROBLEMS: usize = 3;

/// Reads a scene. `file_name` is only used in messages.
///
/// # Errors
/// Every problem found, each at its line and column. Text that is not TOML is reported alone; keys, types, choices and
/// ranges are reported together; rules that join several keys join them as soon as every value has its type.
pub fn parse(text: &str, file_name: &str) -> Result<Scene, SceneErrors> {
    let (mut document, syntax) = DeTable::parse_recoverable(text);
    if !syntax.is_empty() {
        // What the TOML parser says after the first slip is a guess: one a line, and few.
        let mut found: Vec<_> = syntax.iter().map(|error| not_toml(error, text)).collect();
        found.sort_by_key(|(_, span)| span.start);
        found.dedup_by_key(|(_, span)| place_of(text, span.start).0);
        found.truncate(SYNTAX_PROBLEMS);
        return Err(SceneErrors::at(text, file_name, found));
    }
    let mut found = structure::check(&mut document);
    match Scene::deserialize(Deserializer::from(document.clone())) {
        Ok(scene) => {
            let problems = rules::check(&scene);
            found.extend(problems.into_iter().map(|problem| place(problem, &document)));
            if found.is_empty() { Ok(scene) } else { Err(SceneErrors::at(text, file_name, found)) }
        }
        Err(error) => {
            // The structure check says why in better words; this is the net below it.
            if found.is_empty() {
                let problem = Problem::new(Kind::WrongType, "", error.message());
                found.push((problem, error.span().unwrap_or(0..0)));
            }
            Err(SceneErrors::at(text, file_name, found))
        }
    }
}

fn not_toml(error: &toml::de::Error, text: &str) -> (Problem, std::ops::Range<usize>) {
    let message = format!("not valid TOML: {}", error.message().trim().replace('\n', ", "));
    (Problem::new(Kind::Syntax, "", message), error.span().unwrap_or(text.len()..text.len()))
}

fn place(problem: Problem, document: &Spanned<DeTable<'_>>) -> (Problem, std::ops::Range<usize>) {
    let span = span_of(document, &problem.key);
    (problem, span)
}

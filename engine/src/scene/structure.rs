//! A parsed document held against the JSON Schema: keys, types, choices and ranges, each problem at its own span.
//! Knows no rule that joins two keys (see `rules`) and no key by name.

use std::ops::Range;

use serde_json::Value;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::errors::{Kind, Problem};
use super::schema::SCHEMA;

/// All problems of a document's structure. Unknown keys are taken out of it, so that the rest can still be read.
pub(super) fn check(document: &mut Spanned<DeTable<'_>>) -> Vec<(Problem, Range<usize>)> {
    let mut check = Check { found: Vec::new() };
    let span = document.span();
    check.table("", &SCHEMA, document.get_mut(), span);
    check.found
}

struct Check {
    found: Vec<(Problem, Range<usize>)>,
}

impl Check {
    fn report(&mut self, problem: Problem, span: Range<usize>) {
        self.found.push((problem, span));
    }

    /// `about` is the schema at the key itself, whose description is nearer to the user's intent than the type's.
    fn value(&mut self, key: &str, about: &Value, value: &mut Spanned<DeValue<'_>>) {
        let schema = resolve(about);
        let span = value.span();
        let choices = choices(schema);
        if !choices.is_empty() {
            return self.choice(key, &choices, value);
        }
        match (schema["type"].as_str().unwrap_or_default(), value.get_mut()) {
            ("object", DeValue::Table(table)) => self.table(key, schema, table, span),
            ("array", DeValue::Array(items)) => {
                let wanted = schema["minItems"].as_u64();
                if wanted.is_some_and(|wanted| wanted != items.len() as u64) {
                    let wanted = wanted.unwrap_or_default();
                    let message = format!("expected {wanted} numbers, found {}", items.len());
                    self.report(advise(Problem::new(Kind::WrongType, key, message), about), span);
                }
                for (index, item) in items.iter_mut().enumerate() {
                    // Elements of a vector have no description: the vector's serves.
                    let item_schema = &schema["items"];
                    self.item(&format!("{key}[{index}]"), item_schema, about, item);
                }
            }
            ("boolean", DeValue::Boolean(_)) => {}
            ("string", DeValue::String(text)) => {
                if schema["minLength"].as_u64().is_some_and(|least| (text.trim().chars().count() as u64) < least) {
                    self.report(advise(Problem::new(Kind::OutOfRange, key, "must not be empty"), about), span);
                }
            }
            ("integer", DeValue::Integer(_)) | ("number", DeValue::Integer(_) | DeValue::Float(_)) => {
                self.number(key, schema, about, value);
            }
            (wanted, other) => {
                let message = format!("expected {}, found {}", wanted_text(wanted, schema), found_text(other));
                let mut problem = advise(Problem::new(Kind::WrongType, key, message), about);
                if wanted == "array" && matches!(other, DeValue::Table(_)) {
                    let name = key.rsplit('.').next().unwrap_or(key);
                    problem = problem.help(format!("write [[{name}]], once for each"));
                }
                self.report(problem, span);
            }
        }
    }

    fn item(&mut self, key: &str, schema: &Value, about: &Value, item: &mut Spanned<DeValue<'_>>) {
        let leaf = matches!(schema["type"].as_str(), Some("number" | "integer"));
        if leaf && matches!(item.get_ref(), DeValue::Integer(_) | DeValue::Float(_)) {
            self.number(key, schema, about, item);
        } else {
            self.value(key, schema, item);
        }
    }

    fn table(&mut self, key: &str, schema: &Value, table: &mut DeTable<'_>, span: Range<usize>) {
        let properties = &schema["properties"];
        let allowed: Vec<&str> = properties.as_object().into_iter().flatten().map(|(key, _)| key.as_str()).collect();
        let (mut meant, mut unknown) = (Vec::new(), Vec::new());
        for (name, value) in table.iter_mut() {
            let path = join(key, name.get_ref());
            if let Some(property) = properties.get(&**name.get_ref()) {
                self.value(&path, property, value);
                continue;
            }
            let near = nearest(name.get_ref(), &allowed);
            meant.extend(near);
            unknown.push(name.get_ref().to_string());
            let problem = Problem::new(Kind::UnknownKey, path, "unknown key").help(suggest(near, &allowed, "the keys"));
            self.report(problem, name.span());
        }
        for name in &unknown {
            table.remove(name.as_str());
        }
        for name in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            // A misspelt key is one problem, not two.
            if !table.contains_key(name) && !meant.contains(&name) {
                let problem = Problem::new(Kind::MissingKey, key, format!("the key `{name}` is missing"));
                self.report(advise(problem, &properties[name]), span.clone());
            }
        }
    }

    fn choice(&mut self, key: &str, choices: &[(&str, Option<&Value>)], value: &mut Spanned<DeValue<'_>>) {
        let names: Vec<&str> = choices.iter().map(|(name, _)| *name).collect();
        let span = value.span();
        let with_table = choices.iter().any(|(_, schema)| schema.is_some());
        match value.get_mut() {
            DeValue::String(text) => match choices.iter().find(|(name, _)| name == text) {
                Some((_, None)) => {}
                Some((name, Some(_))) => {
                    let problem = Problem::new(Kind::WrongType, key, format!("`{name}` needs a table of its own"));
                    self.report(problem.help(format!("write {key}.{name} = {{ … }}", key = last(key))), span);
                }
                None => {
                    let problem = Problem::new(Kind::UnknownChoice, key, format!("`{text}` is not a choice here"));
                    self.report(problem.help(suggest(nearest(text, &names), &names, "the choices")), span);
                }
            },
            DeValue::Table(table) if with_table => {
                let mut known = Vec::new();
                let before = self.found.len();
                for (name, value) in table.iter_mut() {
                    let path = join(key, name.get_ref());
                    match choices.iter().find(|(choice, _)| choice == name.get_ref()) {
                        Some((choice, schema)) => {
                            known.push(*choice);
                            self.value(&path, schema.unwrap_or(&Value::Null), value);
                        }
                        None => {
                            let help = suggest(nearest(name.get_ref(), &names), &names, "the choices");
                            let problem = Problem::new(Kind::UnknownChoice, path, "not a choice here").help(help);
                            self.report(problem, name.span());
                        }
                    }
                }
                if known.len() > 1 {
                    let message = format!("only one of {} can be used", quoted(&known));
                    self.report(Problem::new(Kind::Conflict, key, message).help("remove all but one"), span);
                } else if known.is_empty() && self.found.len() == before {
                    let problem = Problem::new(Kind::MissingKey, key, "nothing is chosen");
                    self.report(problem.help(suggest(None, &names, "the choices")), span);
                }
            }
            other => {
                let wanted = if with_table { "a table with one choice" } else { "the name of a choice" };
                let problem =
                    Problem::new(Kind::WrongType, key, format!("expected {wanted}, found {}", found_text(other)));
                self.report(problem.help(suggest(None, &names, "the choices")), span);
            }
        }
    }

    fn number(&mut self, key: &str, schema: &Value, about: &Value, value: &Spanned<DeValue<'_>>) {
        let (text, number) = match value.get_ref() {
            DeValue::Integer(integer) => {
                let number = i64::from_str_radix(integer.as_str(), integer.radix());
                (integer.to_string(), number.map_or(f64::INFINITY, |number| number as f64))
            }
            DeValue::Float(float) => (float.to_string(), float.as_str().parse().unwrap_or(f64::INFINITY)),
            _ => return,
        };
        // The limit that counts is the one the value has after rounding to the type it is kept in.
        let number = if schema["format"] == "float" { f64::from(number as f32) } else { number };
        let message = if number.is_finite() {
            match bounds(schema, number) {
                Some(bounds) => format!("{text} is out of range, it must be {bounds}"),
                None => return,
            }
        } else if text.contains("inf") || text.contains("nan") {
            format!("{text} is not a finite number")
        } else {
            format!("{text} is too large")
        };
        self.report(advise(Problem::new(Kind::OutOfRange, key, message), about), value.span());
    }
}

/// The definition behind a reference.
fn resolve(schema: &Value) -> &Value {
    let reference = schema["$ref"].as_str().and_then(|reference| reference.strip_prefix('#'));
    reference.and_then(|pointer| SCHEMA.pointer(pointer)).unwrap_or(schema)
}

/// Names of an enum's variants, with the schema of what each holds when it holds something. Empty: not an enum.
fn choices(schema: &Value) -> Vec<(&str, Option<&Value>)> {
    let mut choices = Vec::new();
    let alone = std::slice::from_ref(schema);
    for one in schema["oneOf"].as_array().map_or(alone, Vec::as_slice) {
        choices.extend(one["const"].as_str().map(|name| (name, None)));
        choices.extend(one["enum"].as_array().into_iter().flatten().filter_map(Value::as_str).map(|name| (name, None)));
        if schema["oneOf"].is_array() {
            let tags = one["properties"].as_object().into_iter().flatten();
            choices.extend(tags.map(|(name, schema)| (name.as_str(), Some(schema))));
        }
    }
    choices
}

/// The allowed range in words when `number` is outside it.
fn bounds(schema: &Value, number: f64) -> Option<String> {
    // schemars states unsigned 32 and 64 bit types by format and a minimum only; TOML itself ends at 63 bits.
    let format_max = (schema["format"] == "uint32").then_some(f64::from(u32::MAX));
    let limits = [
        (schema["minimum"].as_f64(), "at least", (|number, limit| number >= limit) as fn(f64, f64) -> bool),
        (schema["exclusiveMinimum"].as_f64(), "above", |number, limit| number > limit),
        (schema["maximum"].as_f64().or(format_max), "at most", |number, limit| number <= limit),
        (schema["exclusiveMaximum"].as_f64(), "below", |number, limit| number < limit),
    ];
    let stated = limits.iter().filter_map(|(limit, words, holds)| limit.map(|limit| (limit, words, holds)));
    let broken = stated.clone().any(|(limit, _, holds)| !holds(number, limit));
    let words: Vec<String> = stated.map(|(limit, words, _)| format!("{words} {limit}")).collect();
    broken.then(|| words.join(" and "))
}

/// The best match among the allowed names, if one is near enough to be what was meant.
pub(super) fn nearest<'a>(name: &str, allowed: &[&'a str]) -> Option<&'a str> {
    let name = name.to_lowercase();
    let score = |candidate: &str| strsim::jaro_winkler(&name, &candidate.to_lowercase());
    let best = allowed.iter().copied().max_by(|a, b| score(a).total_cmp(&score(b)))?;
    // At 0.8 the slips of tests/bad_scenes find their key and words that only share letters find none.
    (score(best) >= 0.8).then_some(best)
}

pub(super) fn suggest(near: Option<&str>, allowed: &[&str], what: &str) -> String {
    match near {
        Some(near) => format!("did you mean `{near}`?"),
        None if allowed.is_empty() => format!("{what} here: none"),
        None => format!("{what} here: {}", quoted(allowed)),
    }
}

fn quoted(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn advise(problem: Problem, about: &Value) -> Problem {
    let own = about["description"].as_str().or_else(|| resolve(about)["description"].as_str());
    match own {
        Some(description) => problem.help(description.split_whitespace().collect::<Vec<_>>().join(" ")),
        None => problem,
    }
}

fn join(key: &str, name: &str) -> String {
    if key.is_empty() { name.to_owned() } else { format!("{key}.{name}") }
}

fn last(key: &str) -> &str {
    key.rsplit('.').next().unwrap_or(key)
}

fn wanted_text(wanted: &str, schema: &Value) -> String {
    match wanted {
        "object" => "a table".to_owned(),
        "array" => match schema["minItems"].as_u64() {
            Some(count) => format!("{count} numbers in brackets"),
            None => "a list".to_owned(),
        },
        "boolean" => "true or false".to_owned(),
        "integer" => "a whole number".to_owned(),
        "number" => "a number".to_owned(),
        "string" => "text in quotes".to_owned(),
        _ => "nothing".to_owned(),
    }
}

fn found_text(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "text",
        DeValue::Integer(_) => "a whole number",
        DeValue::Float(_) => "a number with a fraction",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

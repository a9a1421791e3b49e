//! The JSON Schema of scene files, from the data model: keys, types, ranges, defaults and descriptions stated once.
//! Knows no rule that joins two keys (see `rules`).

use std::sync::LazyLock;

use schemars::Schema;
use serde_json::{Number, Value};

use super::Scene;

/// The JSON Schema of a scene file, for editors and for the parser, which reads ranges and keys from it.
pub fn schema() -> Schema {
    let mut schema = schemars::schema_for!(Scene);
    if let Some(root) = schema.as_object_mut() {
        root.insert("title".into(), "physvideo scene".into());
        root.values_mut().for_each(tidy);
    }
    schema
}

/// The same, made once.
pub(super) static SCHEMA: LazyLock<Value> = LazyLock::new(|| schema().to_value());

/// TOML has no null, so an optional key is one that may be absent; and f32 defaults are given as people write them.
fn tidy(value: &mut Value) {
    match value {
        Value::Array(items) => items.iter_mut().for_each(tidy),
        Value::Object(object) => {
            object.retain(|_, value| !value.is_null());
            if let Some(types) = object.get_mut("type")
                && let Some([one]) = types.as_array_mut().map(without_null)
            {
                *types = one.take();
            }
            if let Some([Value::Object(one)]) = object.get_mut("anyOf").and_then(Value::as_array_mut).map(without_null)
            {
                let one = std::mem::take(one);
                object.remove("anyOf");
                object.extend(one);
            }
            object.values_mut().for_each(tidy);
        }
        Value::Number(number) if number.is_f64() => {
            // The shortest text that reads back as the same f32: 0.2, not 0.20000000298023224.
            let short = number.as_f64().and_then(|value| (value as f32).to_string().parse().ok());
            if let Some(short) = short.and_then(Number::from_f64) {
                *number = short;
            }
        }
        _ => {}
    }
}

fn without_null(alternatives: &mut Vec<Value>) -> &mut [Value] {
    alternatives.retain(|one| one != "null" && one["type"] != "null");
    alternatives
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::parse;

    /// Keys that may be absent and then mean "not there" or "chosen from the rest", so they have no default value.
    const OPTIONAL: [&str; 39] = [
        "error_budget",
        "stiffness_cap",
        "emitter",
        "rate",
        "lifetime",
        "recycle",
        "to",
        "gravity",
        "photo",
        "camera",
        "ground",
        "principal_px",
        "up",
        "height",
        "force_dt",
        "domain",
        "material",
        "prestress",
        "region",
        "objects",
        "blend_depth",
        "points",
        "checks",
        "light",
        "flow",
        "input",
        "masks",
        "image",
        "background",
        "size",
        "steps",
        "tau_step",
        "beta",
        "pool",
        "reach",
        "guidance",
        "embeddings",
        "negative_embeddings",
        "$schema",
    ];

    fn walk(path: &str, value: &Value, visit: &mut impl FnMut(&str, &Value)) {
        visit(path, value);
        match value {
            Value::Object(object) => object.iter().for_each(|(key, item)| walk(&format!("{path}/{key}"), item, visit)),
            Value::Array(items) => items.iter().for_each(|item| walk(path, item, visit)),
            _ => {}
        }
    }

    #[test]
    fn every_key_is_described_and_every_default_is_stated() {
        let mut keys = 0;
        walk("", &SCHEMA, &mut |path, node| {
            let Some(properties) = node["properties"].as_object() else { return };
            let required = node["required"].as_array().cloned().unwrap_or_default();
            for (key, property) in properties {
                keys += 1;
                let is_tag = properties.len() == 1 && required.len() == 1 && node["description"].is_string();
                assert!(is_tag || property["description"].is_string(), "{path}: `{key}` has no description");
                let may_be_absent = !required.contains(&Value::from(key.as_str()));
                if may_be_absent && !OPTIONAL.contains(&key.as_str()) {
                    assert!(!property["default"].is_null(), "{path}: `{key}` states no default");
                }
            }
        });
        assert!(keys > 60, "the walk saw only {keys} keys");
    }

    #[test]
    fn stated_defaults_are_the_ones_that_take_effect() {
        let scene: Value = serde_json::to_value(parse("", "empty.toml").unwrap()).unwrap();
        for (section, definition) in [("simulation", "Simulation"), ("render", "Render"), ("output", "Output")] {
            let properties = SCHEMA["$defs"][definition]["properties"].as_object().unwrap();
            assert!(!properties.is_empty());
            for (key, property) in properties {
                assert!(same(&scene[section][key], &property["default"]), "{section}.{key}");
            }
        }
        let text = "[[object]]\nname = 'a'\nsource.mask.label = 1\nmaterial.elastic = {}\n[photo]\nimage = 'a'\n\
                    labels = 'b'\nfocal_px = 1\ndepth.metric.file = 'c'\n";
        let scene: Value = serde_json::to_value(parse(text, "small.toml").unwrap()).unwrap();
        let stated = &SCHEMA["$defs"]["Object"]["properties"]["density"]["default"];
        assert!(same(&scene["object"][0]["density"], stated) && *stated == 40.0);
        assert!(same(&scene["object"][0]["material"]["elastic"]["poisson"], &0.32.into()));
        assert!(same(&scene["gravity"], &serde_json::json!([0.0, 0.0, -9.81])));
    }

    // Equal as f32: the schema gives the shortest decimal, the scene its exact f64 value.
    fn same(a: &Value, b: &Value) -> bool {
        match (a, b) {
            (Value::Array(a), Value::Array(b)) => a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b)),
            (Value::Number(a), Value::Number(b)) => a.as_f64().map(|a| a as f32) == b.as_f64().map(|b| b as f32),
            _ => a == b,
        }
    }

    #[test]
    fn numbers_read_as_people_write_them() {
        let text = serde_json::to_string(&*SCHEMA).unwrap();
        assert!(text.contains("\"default\":0.2") && !text.contains("0.2000000"));
        assert!(!text.contains("null"));
    }
}

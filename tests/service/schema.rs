//! A small validator of JSON against the schemas of `/openapi.json`: types, fields, items, alternatives.

use std::sync::OnceLock;

use serde_json::Value;

use crate::harness::get;

/// The description of the service by itself.
pub fn description() -> &'static Value {
    static DESCRIPTION: OnceLock<Value> = OnceLock::new();
    DESCRIPTION.get_or_init(|| get("/openapi.json").body)
}

/// Holds a value against the schema of that name.
pub fn assert_matches(name: &str, value: &Value) {
    let schema = &description()["components"]["schemas"][name];
    assert!(schema.is_object(), "there is no schema {name}");
    if let Err(reason) = check(schema, value, name) {
        panic!("{reason}");
    }
}

/// Holds a value against a schema; fails with the path of the first place that does not match.
pub fn check(schema: &Value, value: &Value, path: &str) -> Result<(), String> {
    if let Some(reference) = schema["$ref"].as_str() {
        let target = description().pointer(&reference[1..]).ok_or(format!("{path}: {reference} leads nowhere"))?;
        return check(target, value, path);
    }
    for key in ["oneOf", "anyOf"] {
        if let Some(ways) = schema[key].as_array() {
            let failures: Vec<String> = ways.iter().filter_map(|way| check(way, value, path).err()).collect();
            return match failures.len() < ways.len() {
                true => Ok(()),
                false => Err(format!("{path}: none of {failures:?}")),
            };
        }
    }
    let types: Vec<&str> = match &schema["type"] {
        Value::String(one) => vec![one.as_str()],
        Value::Array(several) => several.iter().filter_map(Value::as_str).collect(),
        _ => return Ok(()),
    };
    let fits = types.iter().any(|kind| match *kind {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_u64() || value.is_i64(),
        "number" => value.is_number(),
        "null" => value.is_null(),
        _ => false,
    });
    if !fits {
        return Err(format!("{path}: {value} is not {types:?}"));
    }
    if schema["enum"].as_array().is_some_and(|allowed| !allowed.contains(value)) {
        return Err(format!("{path}: {value} is not one of {}", schema["enum"]));
    }
    fields(schema, value, path)?;
    items(schema, value, path)
}

fn fields(schema: &Value, value: &Value, path: &str) -> Result<(), String> {
    let Some(fields) = value.as_object() else {
        return Ok(());
    };
    let missing = schema["required"].as_array().into_iter().flatten();
    if let Some(name) = missing.filter_map(Value::as_str).find(|name| !fields.contains_key(*name)) {
        return Err(format!("{path}: {name} is missing"));
    }
    for (name, field) in fields {
        match (schema["properties"].get(name), schema.get("additionalProperties")) {
            (Some(schema), _) | (None, Some(schema @ Value::Object(_))) => {
                check(schema, field, &format!("{path}.{name}"))?
            }
            (None, _) => return Err(format!("{path}: {name} is not in the schema")),
        }
    }
    Ok(())
}

fn items(schema: &Value, value: &Value, path: &str) -> Result<(), String> {
    let Some(items) = value.as_array() else {
        return Ok(());
    };
    let length = items.len() as u64;
    if schema["minItems"].as_u64().is_some_and(|least| length < least)
        || schema["maxItems"].as_u64().is_some_and(|most| length > most)
    {
        return Err(format!("{path}: {length} items"));
    }
    items.iter().enumerate().try_for_each(|(index, item)| check(&schema["items"], item, &format!("{path}[{index}]")))
}

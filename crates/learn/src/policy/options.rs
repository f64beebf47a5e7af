//! Options of a task as JSON: an object of booleans, numbers, pairs of numbers or texts. Infinite numbers, which JSON
//! lacks, become the texts `inf` and `-inf`.
//!
//! For serde's `with` attribute. A motion clip becomes its name; [`beside`] stores the clips themselves, too.

use marathon_envs::Options;
use marathon_envs::options::Value;
use serde::de::{Error, MapAccess, Visitor};
use serde::ser::SerializeMap;
use serde::{Deserializer, Serializer};
use serde_json::{Value as Json, json};
use std::fmt;

pub mod beside;

/// Writes options.
///
/// # Errors
/// Those of the serializer.
pub fn serialize<S: Serializer>(options: &Options, serializer: S) -> Result<S::Ok, S::Error> {
    let mut map = serializer.serialize_map(None)?;
    for (name, value) in options.iter() {
        map.serialize_entry(name, &document(value))?;
    }
    map.end()
}

/// Reads options.
///
/// # Errors
/// If an option cannot have such a value.
pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Options, D::Error> {
    struct Arguments;
    impl<'de> Visitor<'de> for Arguments {
        type Value = Options;
        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            f.write_str("an object of options")
        }
        fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Options, A::Error> {
            let mut options = Options::new();
            while let Some((name, found)) = map.next_entry::<String, Json>()? {
                let value = value(&found).ok_or_else(|| {
                    let expected = "true or false, a number, two numbers or a text";
                    A::Error::custom(format!("option {name} is {found}, expected {expected}"))
                })?;
                options.set(&name, value);
            }
            Ok(options)
        }
    }
    deserializer.deserialize_map(Arguments)
}

fn document(value: &Value) -> Json {
    let number = |x: f64| if x.is_finite() { json!(x) } else { json!(x.to_string()) };
    match value {
        Value::Bool(x) => json!(x),
        Value::Number(x) => number(*x),
        Value::Pair([a, b]) => json!([number(*a), number(*b)]),
        Value::Text(x) => json!(x),
        Value::Clips(x) => json!(x.to_string()),
    }
}

fn value(document: &Json) -> Option<Value> {
    let number = |x: &Json| match x.as_str() {
        Some("inf") => Some(f64::INFINITY),
        Some("-inf") => Some(f64::NEG_INFINITY),
        _ => x.as_f64(),
    };
    match document {
        Json::Bool(x) => Some((*x).into()),
        Json::Array(pair) => match &pair[..] {
            [a, b] => Some([number(a)?, number(b)?].into()),
            _ => None,
        },
        other => number(other).map(Value::from).or_else(|| other.as_str().map(Value::from)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_come_back_as_they_were() {
        let options = Options::new()
            .with("on", true)
            .with("weight", 0.1)
            .with("most", f64::INFINITY)
            .with("range", [f64::NEG_INFINITY, 2.0])
            .with("clip", "7");
        let text = serialize(&options, serde_json::value::Serializer).unwrap();
        assert_eq!(text["range"], json!(["-inf", 2.0]));
        assert_eq!(deserialize(text).unwrap(), options);
        let error = deserialize(json!({"clip": ["walk", "run"]})).unwrap_err().to_string();
        assert_eq!(error, r#"option clip is ["walk","run"], expected true or false, a number, two numbers or a text"#);
    }
}

//! Settings as YAML text.

use serde_json::{Map, Value};
use std::fmt::Write;

/// Longest line of a mapping that is written on one line.
const LONGEST: usize = 100;

/// A mapping as a document: sections on lines of their own, short ones on one line. `rank` orders the keys of a section by
/// their paths.
pub fn document(map: &Map<String, Value>, rank: &dyn Fn(&str) -> usize) -> String {
    let mut text = String::new();
    write(map, "", 0, rank, &mut text);
    if text.is_empty() { "{}\n".into() } else { text }
}

fn write(map: &Map<String, Value>, path: &str, indent: usize, rank: &dyn Fn(&str) -> usize, text: &mut String) {
    for (key, value) in ordered(map, path, rank) {
        let inner = dotted(path, key);
        let start = format!("{:indent$}{}: ", "", scalar(key));
        let line = flow(value, &inner, rank);
        let nested =
            |map: &Map<String, Value>| map.values().any(|value| value.as_object().is_some_and(|m| m.len() > 2));
        match value {
            Value::Object(map) if !map.is_empty() && (start.len() + line.len() > LONGEST || nested(map)) => {
                let _ = writeln!(text, "{}", start.trim_end());
                write(map, &inner, indent + 2, rank, text);
            }
            _ => {
                let _ = writeln!(text, "{start}{line}");
            }
        }
    }
}

/// A value on one line.
fn flow(value: &Value, path: &str, rank: &dyn Fn(&str) -> usize) -> String {
    let joined = |parts: Vec<String>| parts.join(", ");
    match value {
        Value::Object(map) => {
            let part =
                |(key, value): (&String, &Value)| format!("{}: {}", scalar(key), flow(value, &dotted(path, key), rank));
            format!("{{{}}}", joined(ordered(map, path, rank).into_iter().map(part).collect()))
        }
        Value::Array(items) => format!("[{}]", joined(items.iter().map(|item| flow(item, path, rank)).collect())),
        Value::String(text) => scalar(text),
        Value::Number(number) => self::number(number),
        other => other.to_string(),
    }
}

fn ordered<'m>(map: &'m Map<String, Value>, path: &str, rank: &dyn Fn(&str) -> usize) -> Vec<(&'m String, &'m Value)> {
    let mut entries: Vec<_> = map.iter().collect();
    entries.sort_by_key(|(key, _)| rank(&dotted(path, key)));
    entries
}

fn dotted(path: &str, key: &str) -> String {
    if path.is_empty() { key.into() } else { format!("{path}.{key}") }
}

/// A number in the shorter of its forms: `128`, `8e6`, `1e-5`, `0.985`. It reads as the same bits.
fn number(number: &serde_json::Number) -> String {
    let (plain, short) = match (number.as_u64(), number.as_f64()) {
        (Some(n), _) => (n.to_string(), format!("{n:e}")),
        (None, Some(x)) => (x.to_string(), format!("{x:e}")),
        (None, None) => return number.to_string(),
    };
    // beyond this, a number with an exponent is not read as a whole one
    let exact = number.as_u64().is_none_or(|n| n <= 1 << 53);
    if exact && short.len() + 1 < plain.len() { short } else { plain }
}

/// A text: as it is where YAML reads it as a text, quoted otherwise.
fn scalar(text: &str) -> String {
    let is_plain = text.starts_with(|c: char| c.is_ascii_alphabetic())
        && text.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.' | '/'));
    let reserved = ["true", "false", "yes", "no", "on", "off", "null", "nan", "inf", "infinity"];
    match is_plain && !reserved.iter().any(|word| word.eq_ignore_ascii_case(text)) {
        true => text.into(),
        // a JSON text is a YAML text
        false => Value::from(text).to_string(),
    }
}

/// A value that is no mapping, on one line.
pub fn inline(value: &Value) -> String {
    match value {
        Value::Null => "`null`".into(),
        value => flow(value, "", &|_| 0),
    }
}

//! Comparing compiled models, number by number.

use super::numbers::largest;
use serde_json::Value;

const TOLERANCE: f64 = 1e-9;

/// Compares with the reference values: `null` is not compared, `"none"` stands for an absent value.
pub fn differ(path: &str, ours: &Value, theirs: &Value, out: &mut Vec<String>) {
    match (ours, theirs) {
        (_, Value::Null) => {}
        (Value::Null, Value::String(none)) if none == "none" => {}
        // q and -q are the same principal axes
        (Value::Array(a), Value::Array(b)) if path.ends_with("iquat") && a.len() == 4 && b.len() == 4 => {
            let number = |v: &Value| v.as_f64().unwrap_or(f64::NAN);
            let far = |sign: f64| largest(a.iter().zip(b).map(|(x, y)| (number(x) - sign * number(y)).abs()));
            if !(far(1.0).min(far(-1.0)) <= TOLERANCE) {
                out.push(format!("{path} is {ours}, MuJoCo has {theirs}"));
            }
        }
        (Value::Array(a), Value::Array(b)) => {
            if a.len() != b.len() {
                out.push(format!("{path} has length {}, MuJoCo has {}", a.len(), b.len()));
            }
            a.iter().zip(b).enumerate().for_each(|(i, (a, b))| differ(&format!("{path}[{i}]"), a, b, out));
        }
        (Value::Object(a), Value::Object(b)) => {
            for (key, value) in b {
                differ(&format!("{path}.{key}"), a.get(key).unwrap_or(&Value::Null), value, out);
            }
        }
        (Value::Number(a), Value::Number(b)) => {
            let (a, b) = (a.as_f64().expect("a number"), b.as_f64().expect("a number"));
            let single = ["rgba", "diffuse", ".data"].iter().any(|name| path.contains(name));
            let tolerance = if single { 1e-6 } else { TOLERANCE };
            if !((a - b).abs() <= tolerance * a.abs().max(b.abs()) + 1e-13) {
                out.push(format!("{path} is {a}, MuJoCo has {b}"));
            }
        }
        (ours, theirs) if ours == theirs => {}
        _ => out.push(format!("{path} is {ours}, MuJoCo has {theirs}")),
    }
}

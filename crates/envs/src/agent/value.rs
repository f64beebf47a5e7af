//! Values of options.

use std::fmt;
use std::str::FromStr;

use marathon_motion::Clip;

use super::clips::{Clips, NamedClip};

/// Value of an argument.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// Yes or no.
    Bool(bool),
    /// A number, which may be infinite but is never NaN.
    Number(f64),
    /// The ends of a range.
    Pair([f64; 2]),
    /// A name or a path.
    Text(String),
    /// Motion clips, some of them given. Names alone are a text.
    Clips(Clips),
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Value::Bool(x) => write!(f, "{x}"),
            Value::Number(x) => write!(f, "{x}"),
            Value::Pair([a, b]) => write!(f, "({a}, {b})"),
            Value::Text(x) => write!(f, "'{x}'"),
            Value::Clips(x) => write!(f, "'{x}'"),
        }
    }
}

/// As on a command line: `true`, `-0.5`, `inf`, `0.7,2` or `(0.7, inf)`; whatever else is a text.
impl FromStr for Value {
    type Err = std::convert::Infallible;
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let text = text.trim();
        let number = |s: &str| s.trim().parse::<f64>().ok().filter(|x| !x.is_nan());
        let bare = text.trim_start_matches(['(', '[']).trim_end_matches([')', ']']);
        let pair = bare.split_once(',').and_then(|(a, b)| Some([number(a)?, number(b)?]));
        Ok(match (text.to_lowercase().as_str(), number(text), pair) {
            ("true", ..) => Value::Bool(true),
            ("false", ..) => Value::Bool(false),
            (_, Some(x), _) => Value::Number(x),
            (_, _, Some(x)) => Value::Pair(x),
            _ => Value::Text(text.into()),
        })
    }
}

impl From<bool> for Value {
    fn from(x: bool) -> Self {
        Value::Bool(x)
    }
}
impl From<f64> for Value {
    fn from(x: f64) -> Self {
        Value::Number(x)
    }
}
impl From<[f64; 2]> for Value {
    fn from(x: [f64; 2]) -> Self {
        Value::Pair(x)
    }
}
impl From<&str> for Value {
    fn from(x: &str) -> Self {
        Value::Text(x.into())
    }
}
impl From<Clips> for Value {
    fn from(x: Clips) -> Self {
        match x.has_given() {
            true => Value::Clips(x),
            false => Value::Text(x.to_string()),
        }
    }
}
impl From<NamedClip> for Value {
    fn from(x: NamedClip) -> Self {
        Value::from(Clips::from_iter([x]))
    }
}
/// The clip under its own name.
impl From<Clip> for Value {
    fn from(x: Clip) -> Self {
        NamedClip::from(x).into()
    }
}

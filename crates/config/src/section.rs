//! Sections of a file, and the values in them with everything that an error message needs.

use super::document::{Map, Node, Value};
use super::error::{ConfigError, Place, shown};
use std::ops::RangeInclusive;
use std::path::Path;

/// A mapping, above the mappings that stand in for what it lacks (a behavior above `default_settings`).
#[derive(Clone)]
pub struct Section<'a> {
    file: &'a Path,
    layers: Vec<Layer<'a>>,
}

#[derive(Clone)]
struct Layer<'a> {
    name: String,
    map: &'a Map,
}

/// A key with its value.
#[derive(Clone)]
pub struct Entry<'a> {
    pub place: Place,
    pub key: &'a str,
    pub node: &'a Node,
}

impl<'a> Section<'a> {
    /// The whole file.
    pub fn root(file: &'a Path, map: &'a Map) -> Self {
        Section { file, layers: vec![Layer { name: String::new(), map }] }
    }

    /// This section above another.
    pub fn above(mut self, other: Section<'a>) -> Self {
        self.layers.extend(other.layers);
        self
    }

    pub fn is_empty(&self) -> bool {
        self.layers.iter().all(|layer| layer.map.entries.is_empty())
    }

    /// All keys with their values, those of the lower mappings included.
    pub fn entries(&self) -> impl Iterator<Item = Entry<'a>> {
        let file = self.file;
        self.layers.iter().flat_map(move |layer| {
            layer.map.entries.iter().map(move |field| Entry {
                place: place(file, &layer.name, &field.key, field.line),
                key: &field.key,
                node: &field.node,
            })
        })
    }

    /// The value of a key, `null` included.
    pub fn get(&self, key: &str) -> Option<Entry<'a>> {
        let (layer, field) = self.layers.iter().find_map(|layer| Some((layer, layer.map.get(key)?)))?;
        Some(Entry { place: place(self.file, &layer.name, key, field.line), key: &field.key, node: &field.node })
    }

    /// The value of a key that is not `null`.
    pub fn set(&self, key: &str) -> Option<Entry<'a>> {
        self.get(key).filter(|entry| !entry.node.is_null())
    }

    /// The section under a key; empty if there is none.
    ///
    /// # Errors
    /// If the value is not a mapping.
    pub fn section(&self, key: &str) -> Result<Section<'a>, ConfigError> {
        let mut layers = Vec::new();
        for layer in &self.layers {
            let Some(field) = layer.map.get(key) else { continue };
            match &field.node.value {
                Value::Map(map) => layers.push(Layer { name: dotted(&layer.name, key), map }),
                // nothing hides what is below
                _ if field.node.is_null() => break,
                _ => {
                    let place = place(self.file, &layer.name, key, field.line);
                    return Err(ConfigError::value(place, field.node.describe(), "a mapping"));
                }
            }
        }
        Ok(Section { file: self.file, layers })
    }

    /// Refuses keys that are not among `known`.
    ///
    /// # Errors
    /// Names the first other key, its line and the nearest known one.
    pub fn only(&self, known: &[&str]) -> Result<(), ConfigError> {
        match self.entries().find(|entry| !known.contains(&entry.key)) {
            Some(entry) => {
                let Entry { mut place, key, .. } = entry;
                place.key = shown(&place.key);
                Err(ConfigError::unknown(place, key, known))
            }
            None => Ok(()),
        }
    }

    /// A number within a range, or the default.
    ///
    /// # Errors
    /// If there is something else.
    pub fn number(&self, key: &str, range: Range, default: f64) -> Result<f64, ConfigError> {
        self.get(key).map_or(Ok(default), |entry| entry.number(range))
    }

    /// A whole number within a range, or the default.
    ///
    /// # Errors
    /// If there is something else.
    pub fn count(&self, key: &str, range: RangeInclusive<u64>, default: u64) -> Result<u64, ConfigError> {
        self.get(key).map_or(Ok(default), |entry| entry.count(range))
    }

    /// A truth value, or the default.
    ///
    /// # Errors
    /// If there is something else.
    pub fn flag(&self, key: &str, default: bool) -> Result<bool, ConfigError> {
        self.get(key).map_or(Ok(default), |entry| entry.flag())
    }
}

/// Allowed range of a number.
#[derive(Clone, Copy, Debug)]
pub enum Range {
    /// Above zero.
    Positive,
    /// Zero or above.
    NotNegative,
    /// Between 0 and 1, both included.
    Fraction,
    /// Any.
    Finite,
}

impl Range {
    fn contains(self, x: f64) -> bool {
        x.is_finite()
            && match self {
                Range::Positive => x > 0.0,
                Range::NotNegative => x >= 0.0,
                Range::Fraction => (0.0..=1.0).contains(&x),
                Range::Finite => true,
            }
    }
    /// The range in words, for messages.
    pub fn text(self) -> &'static str {
        match self {
            Range::Positive => "a positive number",
            Range::NotNegative => "a number not below 0",
            Range::Fraction => "a number between 0 and 1",
            Range::Finite => "a number",
        }
    }
}

impl<'a> Entry<'a> {
    pub fn wrong<T>(&self, expected: impl Into<String>) -> Result<T, ConfigError> {
        Err(ConfigError::value(self.place.clone(), self.node.describe(), expected))
    }

    fn text(&self) -> Option<&'a str> {
        match &self.node.value {
            Value::Scalar { text, .. } if !self.node.is_null() => Some(text),
            _ => None,
        }
    }

    pub fn number(&self, range: Range) -> Result<f64, ConfigError> {
        let x = self.text().and_then(real).filter(|x| range.contains(*x));
        x.map_or_else(|| self.wrong(range.text()), Ok)
    }

    pub fn count(&self, range: RangeInclusive<u64>) -> Result<u64, ConfigError> {
        let n = self.text().and_then(whole).filter(|n| range.contains(n));
        n.map_or_else(|| self.wrong(format!("a whole number between {} and {}", range.start(), range.end())), Ok)
    }

    /// Whether it is a number above a bound.
    pub fn is_above(&self, most: u64) -> bool {
        self.text().and_then(real).is_some_and(|x| x > most as f64)
    }

    /// A number of steps, also in a short form.
    pub fn steps(&self) -> Option<u64> {
        self.text().and_then(steps)
    }

    pub fn flag(&self) -> Result<bool, ConfigError> {
        // YAML 1.1, which ML-Agents reads
        match self.text().map(str::to_ascii_lowercase).as_deref() {
            Some("true" | "yes" | "on") => Ok(true),
            Some("false" | "no" | "off") => Ok(false),
            _ => self.wrong("true or false"),
        }
    }

    /// One of some words, ignoring case; returns its index.
    pub fn word(&self, words: &[&str]) -> Result<usize, ConfigError> {
        let found = self.text().and_then(|text| words.iter().position(|w| w.eq_ignore_ascii_case(text)));
        found.map_or_else(|| self.wrong(format!("one of {}", words.join(", "))), Ok)
    }

    /// A text that is not nothing.
    pub fn word_of_any_kind(&self, expected: &str) -> Result<String, ConfigError> {
        self.text().filter(|text| !text.is_empty()).map_or_else(|| self.wrong(expected), |text| Ok(text.to_string()))
    }

    /// The entries of a list.
    pub fn items(&self, expected: &str) -> Result<Vec<Entry<'a>>, ConfigError> {
        match &self.node.value {
            Value::List(items) => {
                let item = |node: &'a Node| Entry {
                    place: Place { line: node.line, ..self.place.clone() },
                    key: self.key,
                    node,
                };
                Ok(items.iter().map(item).collect())
            }
            _ => self.wrong(expected),
        }
    }
}

/// Largest whole number below which all are exactly representable; far above anything meant.
const EXACT: f64 = 9_007_199_254_740_992.0;

/// A number as Python reads it: `5e4`, `1.e7`, `.003`, `1_000`.
fn real(text: &str) -> Option<f64> {
    let digits = text.contains(|c: char| c.is_ascii_digit());
    text.replace('_', "").parse().ok().filter(|x: &f64| digits && x.is_finite())
}

/// A whole number, also written as a float.
fn whole(text: &str) -> Option<u64> {
    text.replace('_', "").parse().ok().or_else(|| {
        let x = real(text)?;
        (x.fract() == 0.0 && (0.0..=EXACT).contains(&x)).then_some(x as u64)
    })
}

/// A number of steps: digits with `_` or `,` between them, or a short form such as `500k`, `2.5M`, `1G` or `1e6`. `None` for
/// anything else, and for a part of a step.
pub fn steps(text: &str) -> Option<u64> {
    let text = text.replace(',', "");
    let (number, factor) = match text.chars().last()? {
        'k' | 'K' => (&text[..text.len() - 1], 1e3),
        'm' | 'M' => (&text[..text.len() - 1], 1e6),
        'g' | 'G' => (&text[..text.len() - 1], 1e9),
        _ => return whole(&text),
    };
    let steps = real(number)? * factor;
    // 4.35 is not exact
    let near = steps.round();
    ((steps - near).abs() <= 1e-9 * near && (0.0..=EXACT).contains(&near)).then_some(near as u64)
}

fn place(file: &Path, section: &str, key: &str, line: usize) -> Place {
    Place { file: file.into(), line, key: dotted(section, key) }
}

fn dotted(section: &str, key: &str) -> String {
    if section.is_empty() { key.into() } else { format!("{section}.{key}") }
}

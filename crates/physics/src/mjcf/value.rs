//! Attribute values: a text becomes numbers, a flag or a keyword, with defaults of classes laid underneath.

use super::compiler::Tristate;
use super::document::{Attr, Element};
use super::error::MjcfError;
use crate::hint::{did_you_mean, nearest};

/// The attributes of an element on top of those of its default classes.
///
/// A value is looked up in the element first, then in the nearest class. Vectors that may be given in part
/// (`size`, `friction`, `solref`...) are laid over each other number by number, as MuJoCo does.
#[derive(Clone, Copy)]
pub(crate) struct Attrs<'a> {
    /// The element itself.
    pub element: &'a Element,
    /// `<default>` elements of the same kind, outermost class first.
    pub defaults: &'a [&'a Element],
}

const FLAG: [(&str, bool); 2] = [("false", false), ("true", true)];
const TRISTATE: [(&str, Tristate); 3] =
    [("false", Tristate::False), ("true", Tristate::True), ("auto", Tristate::Auto)];

impl<'a> Attrs<'a> {
    /// Only the element: for kinds of elements without default classes.
    pub fn plain(element: &'a Element) -> Self {
        Attrs { element, defaults: &[] }
    }

    /// Outermost class first, the element last.
    pub fn chain(&self) -> impl DoubleEndedIterator<Item = &'a Element> {
        self.defaults.iter().copied().chain(std::iter::once(self.element))
    }

    /// The attribute that counts, and the element that has it.
    pub fn find(&self, name: &str) -> Option<(&'a Element, &'a Attr)> {
        self.chain().rev().find_map(|e| e.attr(name).map(|a| (e, a)))
    }

    /// Whether the attribute is given anywhere.
    pub fn has(&self, name: &str) -> bool {
        self.find(name).is_some()
    }

    /// The attribute's text; an empty text counts as absent.
    pub fn text(&self, name: &str) -> Option<&'a str> {
        self.find(name).map(|(_, a)| a.value.as_str()).filter(|v| !v.is_empty())
    }

    /// Lays the numbers given over `out`; each text must have at least `at_least` and at most `out.len()`.
    pub fn overlay(&self, name: &str, at_least: usize, out: &mut [f64]) -> Result<bool, MjcfError> {
        let mut found = false;
        let at_least = at_least.min(out.len());
        for element in self.chain() {
            let Some(attr) = element.attr(name) else { continue };
            // as in MuJoCo, an empty text is no value
            if attr.value.trim_ascii().is_empty() {
                continue;
            }
            let values = numbers(element, attr, at_least, out.len())?;
            out[..values.len()].copy_from_slice(&values);
            found = true;
        }
        Ok(found)
    }

    /// Exactly `N` numbers, if given.
    pub fn array<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>, MjcfError> {
        let mut out = [0.0; N];
        Ok(self.overlay(name, N, &mut out)?.then_some(out))
    }

    /// Exactly `N` numbers or the default.
    pub fn array_or<const N: usize>(&self, name: &str, default: [f64; N]) -> Result<[f64; N], MjcfError> {
        Ok(self.array(name)?.unwrap_or(default))
    }

    /// Up to `N` numbers laid over the default.
    pub fn partial_or<const N: usize>(&self, name: &str, mut default: [f64; N]) -> Result<[f64; N], MjcfError> {
        self.overlay(name, 0, &mut default)?;
        Ok(default)
    }

    /// One number or the default.
    pub fn number_or(&self, name: &str, default: f64) -> Result<f64, MjcfError> {
        Ok(self.array_or(name, [default])?[0])
    }

    /// One integer or the default.
    pub fn integer_or(&self, name: &str, default: i32) -> Result<i32, MjcfError> {
        match self.find(name) {
            Some((element, attr)) if !attr.value.trim_ascii().is_empty() => integer(element, attr),
            _ => Ok(default),
        }
    }

    /// `true` or `false`.
    pub fn flag_or(&self, name: &str, default: bool) -> Result<bool, MjcfError> {
        Ok(self.keyword(name, &FLAG)?.unwrap_or(default))
    }

    /// `true`, `false` or `auto`, the default.
    pub fn tristate(&self, name: &str) -> Result<Tristate, MjcfError> {
        Ok(self.keyword(name, &TRISTATE)?.unwrap_or(Tristate::Auto))
    }

    /// One of several keywords.
    pub fn keyword<T: Copy>(&self, name: &str, choices: &[(&str, T)]) -> Result<Option<T>, MjcfError> {
        let Some((element, attr)) = self.find(name) else { return Ok(None) };
        keyword(element, attr, choices).map(Some)
    }

    /// Color with its alpha.
    pub fn rgba(&self) -> Result<Option<[f32; 4]>, MjcfError> {
        Ok(self.array::<4>("rgba")?.map(|c| c.map(|x| x as f32)))
    }
}

/// Coefficients of a polynomial: the linear one and the two higher ones.
pub(crate) fn polynomial(attrs: &Attrs, name: &str) -> Result<(f64, [f64; 2]), MjcfError> {
    let [linear, second, third] = attrs.partial_or(name, [0.0; 3])?;
    Ok((linear, [second, third]))
}

/// The choice that `attr` names.
pub(crate) fn keyword<T: Copy>(element: &Element, attr: &Attr, choices: &[(&str, T)]) -> Result<T, MjcfError> {
    if let Some(&(_, value)) = choices.iter().find(|(word, _)| *word == attr.value) {
        return Ok(value);
    }
    let words: Vec<&str> = choices.iter().map(|(word, _)| *word).collect();
    let hint = did_you_mean(nearest(&attr.value, words.iter().copied()));
    Err(element.bad_value(attr, format!("one of {}{hint}", words.join(", "))))
}

/// All numbers of an attribute, between `at_least` and `at_most` of them.
pub(crate) fn numbers(element: &Element, attr: &Attr, at_least: usize, at_most: usize) -> Result<Vec<f64>, MjcfError> {
    let values: Option<Vec<f64>> = attr.value.split_ascii_whitespace().map(number).collect();
    let expected = || match (at_least, at_most) {
        (_, 0) => "no numbers: the model has none of these".to_owned(),
        (1, 1) => "a number".to_owned(),
        (least, most) if least == most => format!("{least} numbers"),
        (0, usize::MAX) => "numbers".to_owned(),
        (least, usize::MAX) => format!("at least {least} numbers"),
        (0, most) => format!("up to {most} numbers"),
        (least, most) => format!("{least} to {most} numbers"),
    };
    match values {
        Some(values) if (at_least..=at_most).contains(&values.len()) => Ok(values),
        Some(values) => Err(element.bad_value(attr, format!("{}, but there are {}", expected(), values.len()))),
        None => Err(element.bad_value(attr, expected())),
    }
}

/// One finite number. Infinities are refused: no attribute read here has a use for them.
fn number(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|x| x.is_finite())
}

/// One 32-bit integer.
pub(crate) fn integer(element: &Element, attr: &Attr) -> Result<i32, MjcfError> {
    attr.value.trim_ascii().parse().map_err(|_| element.bad_value(attr, "an integer"))
}

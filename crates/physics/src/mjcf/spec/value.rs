//! Values of attributes as text.

/// The value of an attribute: a word, a flag, or numbers.
///
/// Numbers are written so that reading them gives the same bits.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AttrValue(pub(super) String);

impl From<&str> for AttrValue {
    fn from(text: &str) -> Self {
        AttrValue(text.to_owned())
    }
}

impl From<String> for AttrValue {
    fn from(text: String) -> Self {
        AttrValue(text)
    }
}

impl From<bool> for AttrValue {
    fn from(flag: bool) -> Self {
        AttrValue(flag.to_string())
    }
}

impl From<f64> for AttrValue {
    fn from(number: f64) -> Self {
        AttrValue(number.to_string())
    }
}

impl From<i32> for AttrValue {
    fn from(number: i32) -> Self {
        AttrValue(number.to_string())
    }
}

impl From<usize> for AttrValue {
    fn from(number: usize) -> Self {
        AttrValue(number.to_string())
    }
}

impl From<&[f64]> for AttrValue {
    fn from(numbers: &[f64]) -> Self {
        AttrValue(numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" "))
    }
}

impl<const N: usize> From<[f64; N]> for AttrValue {
    fn from(numbers: [f64; N]) -> Self {
        numbers.as_slice().into()
    }
}

impl<const N: usize> From<&[f64; N]> for AttrValue {
    fn from(numbers: &[f64; N]) -> Self {
        numbers.as_slice().into()
    }
}

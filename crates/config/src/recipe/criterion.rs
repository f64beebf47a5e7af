//! Measures of a policy in a recipe: `lowest falls` and `return_mean > 500`.

use std::fmt;

/// A choice between policies: the lowest or the highest value of a measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Pick {
    /// Whether the highest value is the best, not the lowest.
    pub highest: bool,
    /// Name of the measure.
    pub measure: String,
}

/// A bound of a measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Criterion {
    /// Name of the measure.
    pub measure: String,
    /// Whether the measure must be above the bound, not below it.
    pub above: bool,
    /// The bound.
    pub bound: f64,
}

impl Pick {
    /// Values that a file may have, for messages.
    pub const EXPECTED: &'static str = "'lowest' or 'highest' and a measure, such as lowest falls";

    /// Reads a choice.
    pub fn read(text: &str) -> Option<Self> {
        let [way, measure] = text.split_whitespace().collect::<Vec<_>>()[..] else { return None };
        let highest = match way {
            "highest" => true,
            "lowest" => false,
            _ => return None,
        };
        Some(Pick { highest, measure: measure.into() })
    }

    /// Index of the best value. The first of equal values is the best; missing values are the worst.
    pub fn best(&self, values: &[Option<f64>]) -> Option<usize> {
        let sign = if self.highest { -1.0 } else { 1.0 };
        let known = values.iter().enumerate().filter_map(|(i, value)| Some((i, sign * (*value)?)));
        known.min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i)
    }
}

impl Criterion {
    /// Values that a file may have, for messages.
    pub const EXPECTED: &'static str = "a measure, < or >, and a number, such as return_mean > 500";

    /// Reads a bound.
    pub fn read(text: &str) -> Option<Self> {
        let at = text.find(['<', '>'])?;
        let (measure, bound) = (text[..at].trim(), text[at + 1..].trim());
        let is_name = !measure.is_empty() && !measure.contains(char::is_whitespace);
        let bound: f64 = bound.parse().ok().filter(|x: &f64| x.is_finite())?;
        is_name.then(|| Criterion { measure: measure.into(), above: text[at..].starts_with('>'), bound })
    }

    /// Whether a value is beyond the bound. A missing value is not.
    pub fn is_met(&self, value: Option<f64>) -> bool {
        value.is_some_and(|value| if self.above { value > self.bound } else { value < self.bound })
    }
}

impl fmt::Display for Pick {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", if self.highest { "highest" } else { "lowest" }, self.measure)
    }
}

impl fmt::Display for Criterion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {} {}", self.measure, if self.above { '>' } else { '<' }, self.bound)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measures_have_bounds_and_order() {
        let pick = Pick::read("lowest  falls").unwrap();
        assert_eq!(
            (pick.to_string(), pick.best(&[None, Some(2.0), Some(1.0), Some(1.0)])),
            ("lowest falls".into(), Some(2))
        );
        assert_eq!(Pick::read("highest return_mean").unwrap().best(&[Some(-3.0), Some(f64::NEG_INFINITY)]), Some(0));
        assert_eq!(pick.best(&[None]), None);
        for text in ["falls", "least falls", "lowest falls now", ""] {
            assert_eq!(Pick::read(text), None, "{text}");
        }
        let until = Criterion::read("falls<3").unwrap();
        assert_eq!(until.to_string(), "falls < 3");
        assert!(until.is_met(Some(2.0)) && !until.is_met(Some(3.0)) && !until.is_met(None));
        assert!(Criterion::read("return_mean > -1e2").unwrap().is_met(Some(-99.0)));
        for text in ["falls", "falls <", "< 3", "falls = 3", "falls <= 3", "two words < 3", "falls < inf"] {
            assert_eq!(Criterion::read(text), None, "{text}");
        }
    }
}

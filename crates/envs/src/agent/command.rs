//! Commands: the numbers that a caller or a schedule sets for an agent.

use std::ops::RangeInclusive;

/// One number of an agent's command, see [`Facts::command`](crate::Facts::command).
#[derive(Clone, Debug, PartialEq)]
pub struct CommandRange {
    /// Name, such as `velocity`.
    pub name: String,
    /// Lowest value.
    pub low: f64,
    /// Highest value.
    pub high: f64,
    /// Unit, such as `m/s`; empty for a pure number.
    pub unit: String,
}

impl CommandRange {
    /// A number with this name, range and unit.
    pub fn new(name: &str, range: RangeInclusive<f64>, unit: &str) -> Self {
        CommandRange { name: name.into(), low: *range.start(), high: *range.end(), unit: unit.into() }
    }

    /// Whether it is a speed, which a stick controls.
    pub fn is_speed(&self) -> bool {
        self.unit == "m/s"
    }

    /// Whether it is a turn rate.
    pub fn is_turn(&self) -> bool {
        self.unit == "rad/s"
    }

    /// Whether it is a button: a number from 0 to 1 without a unit.
    pub fn is_button(&self) -> bool {
        self.unit.is_empty() && self.low == 0.0 && self.high == 1.0
    }

    /// Returns `x` if it is in the range. Callers may use single precision, which cannot represent every end of a
    /// range. A value that equals an end in single precision counts as that end.
    pub fn fit(&self, x: f64) -> Option<f64> {
        let is_end = |end: f64| x.is_finite() && x as f32 == end as f32;
        match x {
            x if (self.low..=self.high).contains(&x) => Some(x),
            x if x < self.low && is_end(self.low) => Some(self.low),
            x if x > self.high && is_end(self.high) => Some(self.high),
            // NaN is in no range
            _ => None,
        }
    }

    /// The value nearest to zero. It is the command before any is set.
    pub fn rest(&self) -> f64 {
        0.0_f64.max(self.low).min(self.high)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::FRAC_PI_2;

    #[test]
    fn an_end_in_single_precision_is_in_the_range() {
        let turn = CommandRange::new("turn", -FRAC_PI_2..=FRAC_PI_2, "rad/s");
        let single = f64::from(std::f32::consts::FRAC_PI_2);
        assert!(single > FRAC_PI_2);
        assert_eq!(
            [single, -single, FRAC_PI_2, 0.1].map(|x| turn.fit(x)),
            [Some(FRAC_PI_2), Some(-FRAC_PI_2), Some(FRAC_PI_2), Some(0.1)]
        );
        let beyond = f64::from(std::f32::consts::FRAC_PI_2.next_up());
        assert_eq!([beyond, -beyond, f64::NAN, f64::INFINITY].map(|x| turn.fit(x)), [None; 4]);
        let step = CommandRange::new("left", -0.8..=0.8, "m/s");
        assert_eq!([f64::from(0.8_f32), -f64::from(0.8_f32)].map(|x| step.fit(x)), [Some(0.8), Some(-0.8)]);
        let any = CommandRange::new("x", f64::MIN..=f64::MAX, "");
        assert_eq!([f64::INFINITY, f64::NAN].map(|x| any.fit(x)), [None; 2]);
    }
}

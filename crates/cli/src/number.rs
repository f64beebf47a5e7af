//! Numbers on the command line.

use std::ops::RangeInclusive;

/// Parser of a whole number in a range, with the short forms of `--steps`.
pub fn count<N: TryFrom<u64>>(range: RangeInclusive<u64>) -> impl Fn(&str) -> Result<N, String> + Clone {
    move |text| {
        let number = marathon_config::steps(text).filter(|number| range.contains(number));
        number.and_then(|number| number.try_into().ok()).ok_or_else(|| match (range.start(), range.end()) {
            (0, &u64::MAX) => "expected a whole number such as 1000 or 1e3".into(),
            (least, most) => format!("expected a whole number from {least} to {most}"),
        })
    }
}

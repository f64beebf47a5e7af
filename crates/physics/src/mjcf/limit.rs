//! Ranges with a switch, such as `range` and `limited`: whether they apply, and the checks of both.

use super::compiler::Settings;
use super::compiler::Tristate;
use super::error::MjcfError;
use super::value::Attrs;

/// Whether a range applies: as switched, or as it is given when the switch is `auto`.
pub(crate) fn is_limited(attrs: &Attrs, switch: &str, range: [f64; 2]) -> Result<bool, MjcfError> {
    Ok(match attrs.tristate(switch)? {
        Tristate::False => false,
        Tristate::True => true,
        Tristate::Auto => range[0] < range[1],
    })
}

/// Checks that a range has its flag, if the compiler does not infer the flag.
pub(crate) fn check_switch(
    attrs: &Attrs,
    switch: &str,
    name: &str,
    range: [f64; 2],
    settings: &Settings,
) -> Result<(), MjcfError> {
    let given = range[0] != 0.0 || range[1] != 0.0;
    if attrs.tristate(switch)? == Tristate::Auto && given && !settings.of(attrs.element).autolimits {
        let message = format!("there is '{name}' but not '{switch}', and the compiler's autolimits is false");
        return Err(attrs.element.invalid(message));
    }
    Ok(())
}

/// Checks a range and its flag in an element of the model. A class may have an incomplete range, which an element
/// completes.
pub(crate) fn check_limit(
    attrs: &Attrs,
    switch: &str,
    name: &str,
    range: [f64; 2],
    settings: &Settings,
) -> Result<(), MjcfError> {
    check_switch(attrs, switch, name, range, settings)?;
    if is_limited(attrs, switch, range)? && !(range[0] < range[1]) {
        let [low, high] = range;
        return Err(attrs.element.invalid(format!("'{name}' goes from {low} to {high}; the first must be smaller")));
    }
    Ok(())
}

//! `<muscle>`: the numbers of its force, and the range of its lengths.

use super::compiler::LengthRange;
use super::document::Element;
use super::error::MjcfError;
use super::value::Attrs;
use crate::model::{Model, Muscle, Transmission};

/// Range, force, scale, lmin, lmax, vmax, fpmax and fvmax of a muscle that sets none of them.
pub(crate) const NUMBERS: [f64; 10] = [0.75, 1.05, -1.0, 200.0, 0.5, 1.6, 1.5, 1.3, 1.2, 0.0];
/// Its time constants of activation and deactivation, and the width of the transition between them.
pub(crate) const TIMES: [f64; 3] = [0.01, 0.04, 0.0];

/// Reads the attributes of a `<muscle>` over the numbers so far. As in MuJoCo, negative numbers leave them as they are.
pub(crate) fn read(attrs: &Attrs, numbers: &mut [f64; 10], times: &mut [f64; 3]) -> Result<(), MjcfError> {
    let set = |to: &mut f64, given: f64| {
        if given >= 0.0 {
            *to = given;
        }
    };
    for (name, at) in [("range", numbers.split_at_mut(2).0), ("timeconst", times.split_at_mut(2).0)] {
        let given = attrs.array_or(name, [-1.0; 2])?;
        at.iter_mut().zip(given).for_each(|(to, given)| set(to, given));
    }
    for (at, name) in ["force", "scale", "lmin", "lmax", "vmax", "fpmax", "fvmax"].into_iter().enumerate() {
        set(&mut numbers[2 + at], attrs.number_or(name, -1.0)?);
    }
    times[2] = attrs.number_or("tausmooth", times[2])?;
    if times[2] < 0.0 {
        return Err(attrs.element.invalid("tausmooth must not be negative"));
    }
    Ok(())
}

/// The force of a muscle over a range of lengths. A negative force is the scale of the one that the inertia decides
/// later.
pub(crate) fn muscle(element: &Element, numbers: &[f64; 10], length_range: [f64; 2]) -> Result<Muscle, MjcfError> {
    let [low, high, force, scale, lmin, lmax, vmax, fpmax, fvmax, _] = *numbers;
    if !(low < high) {
        return Err(
            element.invalid(format!("the range of the muscle goes from {low} to {high}; the first must be smaller"))
        );
    }
    if !(lmin < 1.0 && 1.0 < lmax) {
        return Err(element.invalid(format!("lmin is {lmin} and lmax is {lmax}; 1 must be between them")));
    }
    for (name, value) in [("scale", scale), ("vmax", vmax), ("fpmax", fpmax), ("fvmax", fvmax)] {
        if !(value > 0.0) {
            return Err(element.invalid(format!("{name} of the muscle is {value}; it must be positive")));
        }
    }
    let force = if force < 0.0 { -scale } else { force };
    Ok(Muscle { length_range, range: [low, high], force, lmin, lmax, vmax, fpmax, fvmax })
}

impl LengthRange {
    /// Takes over what an element sets.
    pub fn apply(&mut self, element: &Element) -> Result<(), MjcfError> {
        let attrs = Attrs::plain(element);
        let modes = [("none", false), ("muscle", true), ("muscleuser", true), ("all", true)];
        self.computed = attrs.keyword("mode", &modes)?.unwrap_or(self.computed);
        self.existing = attrs.flag_or("useexisting", self.existing)?;
        self.limits = attrs.flag_or("uselimit", self.limits)?;
        Ok(())
    }

    /// The range of lengths of a muscle.
    pub fn of(&self, attrs: &Attrs, target: Transmission, model: &Model) -> Result<[f64; 2], MjcfError> {
        let given = attrs.array_or("lengthrange", [0.0; 2])?;
        if !self.computed || (self.existing && given[0] < given[1]) {
            return Ok(given);
        }
        let limit = match target {
            Transmission::Joint(j) | Transmission::JointInParent(j) => {
                model.joints[j].limited.then_some(model.joints[j].range)
            }
            Transmission::Tendon(t) => model.tendons[t].limited.then_some(model.tendons[t].range),
            Transmission::Site { .. } | Transmission::SliderCrank { .. } | Transmission::Body(_) => None,
        };
        limit.filter(|_| self.limits).ok_or_else(|| {
            let reason = "the simulation that finds it is not supported; give two numbers, or set \
                          <lengthrange uselimit=\"true\"/> in <compiler> and limit the joint or tendon";
            attrs.element.unsupported(Some("lengthrange"), reason)
        })
    }
}

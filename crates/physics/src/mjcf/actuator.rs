//! `<actuator>`: motors and servos on joints.

use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::joint::{check_limit, is_limited};
use super::math::MIN_VAL;
use super::names::Registry;
use super::set0::MassMatrix;
use super::settings::{Settings, entries};
use super::value::Attrs;
use crate::model::{Actuator, JointType, Model};

/// Gain and bias as the elements of a class and the actuator itself set them, one after the other.
#[derive(Clone, Copy)]
struct Law<'a> {
    /// Element that set the law last.
    element: &'a str,
    gain: [f64; 3],
    gain_affine: bool,
    bias: [f64; 3],
    bias_affine: bool,
}

impl<'a> Law<'a> {
    const GENERAL: Law<'static> =
        Law { element: "general", gain: [1.0, 0.0, 0.0], gain_affine: false, bias: [0.0; 3], bias_affine: false };

    /// The law of an actuator: the classes' elements in order, then its own.
    ///
    /// `ends` counts the elements up to the end of each class, outermost first.
    fn compile(attrs: &Attrs<'a>, ends: &[usize]) -> Result<Self, MjcfError> {
        let mut law: Law = Law::GENERAL;
        let mut enclosing: Vec<Law> = Vec::new();
        for (i, element) in attrs.chain().enumerate() {
            // the element's own class, the last one, stays open for it
            while enclosing.len() + 1 < ends.len() && ends[enclosing.len()] <= i {
                enclosing.push(law);
            }
            law.apply(element, &enclosing)?;
        }
        Ok(law)
    }

    /// Whether a shortcut element can take its parameters from this law.
    fn serves(&self, shortcut: &str) -> bool {
        self.element == shortcut || (self.element == "general" && !self.gain_affine)
    }

    /// Applies one element. What a shortcut does not set it takes from the law so far, else from the nearest enclosing
    /// class with a law of its own kind or a general one.
    fn apply(&mut self, element: &'a Element, enclosing: &[Law<'a>]) -> Result<(), MjcfError> {
        let attrs = Attrs::plain(element);
        let name = element.name.as_str();
        if name == "general" {
            return self.general(element, &attrs);
        }
        if !self.serves(name) {
            *self = enclosing.iter().rev().find(|law| law.serves(name)).copied().unwrap_or(Law::GENERAL);
        }
        let kept = self.gain[0];
        match name {
            "position" => {
                let kp = attrs.number_or("kp", kept)?;
                let kv: Option<[f64; 1]> = attrs.array("kv")?;
                let ratio: Option<[f64; 1]> = attrs.array("dampratio")?;
                let damping = match (kv, ratio) {
                    (Some(_), Some(_)) => return Err(element.invalid("there are both 'kv' and 'dampratio'")),
                    (Some([kv]), None) if kv < 0.0 => return Err(element.invalid("kv must not be negative")),
                    (None, Some([r])) if r < 0.0 => return Err(element.invalid("dampratio must not be negative")),
                    (Some([kv]), None) => -kv,
                    // a positive number marks a damping ratio, which the inertia turns into damping later
                    (None, Some([ratio])) => ratio,
                    (None, None) => self.bias[2],
                };
                (self.gain, self.bias) = ([kp, 0.0, 0.0], [0.0, -kp, damping]);
            }
            "velocity" => {
                let kv = attrs.number_or("kv", kept)?;
                (self.gain, self.bias) = ([kv, 0.0, 0.0], [0.0, 0.0, -kv]);
            }
            _ => *self = Law::GENERAL,
        }
        (self.element, self.gain_affine, self.bias_affine) = (name, false, name != "motor");
        Ok(())
    }

    /// `<general>` changes what it gives and keeps the rest.
    fn general(&mut self, element: &'a Element, attrs: &Attrs) -> Result<(), MjcfError> {
        self.element = "general";
        for (name, values) in [("gainprm", &mut self.gain), ("biasprm", &mut self.bias)] {
            let mut all = [0.0; 10];
            all[..3].copy_from_slice(values);
            attrs.overlay(name, 0, &mut all)?;
            if all[3..].iter().any(|x| *x != 0.0) {
                return Err(element.unsupported(Some(name), "only the first three numbers are supported"));
            }
            values.copy_from_slice(&all[..3]);
        }
        let gains = [("fixed", Some(false)), ("affine", Some(true)), ("muscle", None), ("user", None)];
        let biases = [("none", Some(false)), ("affine", Some(true)), ("muscle", None), ("user", None)];
        for (name, choices, affine) in
            [("gaintype", gains, &mut self.gain_affine), ("biastype", biases, &mut self.bias_affine)]
        {
            match attrs.keyword(name, &choices)? {
                Some(Some(value)) => *affine = value,
                Some(None) => {
                    let reason = "only constant and affine laws are supported";
                    return Err(element.unsupported(Some(name), reason));
                }
                None => {}
            }
        }
        Ok(())
    }
}

/// All elements of `<actuator>` sections.
pub(crate) fn elements(root: &Element) -> impl Iterator<Item = &Element> {
    entries(root, "actuator")
}

/// Checks the values of an actuator element that sets defaults.
pub(crate) fn check_default(attrs: &Attrs) -> Result<(), MjcfError> {
    Law::compile(attrs, &[])?;
    ranges(attrs).map(|_| ())
}

/// Control and force limits: whether they apply, and from where to where.
struct Ranges {
    gear: [f64; 6],
    ctrl_limited: bool,
    ctrl: [f64; 2],
    force_limited: bool,
    force: [f64; 2],
}

fn ranges(attrs: &Attrs) -> Result<Ranges, MjcfError> {
    let ctrl = attrs.array_or("ctrlrange", [0.0; 2])?;
    let force = attrs.array_or("forcerange", [0.0; 2])?;
    Ok(Ranges {
        gear: attrs.partial_or("gear", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?,
        ctrl_limited: is_limited(attrs, "ctrllimited", ctrl)?,
        ctrl,
        force_limited: is_limited(attrs, "forcelimited", force)?,
        force,
    })
}

/// Compiles all actuators.
pub(crate) fn compile(
    root: &Element,
    defaults: &Defaults,
    names: &Registry,
    settings: &Settings,
    model: &Model,
) -> Result<Vec<Actuator>, MjcfError> {
    elements(root).map(|element| actuator(element, defaults, names, settings, model)).collect()
}

fn actuator(
    element: &Element,
    defaults: &Defaults,
    names: &Registry,
    settings: &Settings,
    model: &Model,
) -> Result<Actuator, MjcfError> {
    let (attrs, ends) = defaults.actuator(element)?;
    let joint = target(element, names, model)?;
    let law = Law::compile(&attrs, ends)?;
    let mut ranges = ranges(&attrs)?;
    check_limit(&attrs, "forcelimited", "forcerange", ranges.force, settings)?;
    match inherited_range(&attrs)? {
        Some(part) => {
            let [low, high] = model.joints[joint].range;
            if !(low < high) {
                let message = format!("'inheritrange' needs a range of the joint '{}'", model.joints[joint].name);
                return Err(element.invalid(message));
            }
            let (middle, radius) = ((low + high) / 2.0, part * (high - low) / 2.0);
            ranges.ctrl = [middle - radius, middle + radius];
            ranges.ctrl_limited = is_limited(&attrs, "ctrllimited", ranges.ctrl)?;
        }
        None => check_limit(&attrs, "ctrllimited", "ctrlrange", ranges.ctrl, settings)?,
    }
    // without its type an affine law has no effect, so it is not stored
    Ok(Actuator {
        name: element.text("name").unwrap_or_default().to_owned(),
        joint,
        gear: ranges.gear,
        ctrl_limited: ranges.ctrl_limited,
        ctrl_range: ranges.ctrl,
        force_limited: ranges.force_limited,
        force_range: ranges.force,
        gain: if law.gain_affine { law.gain } else { [law.gain[0], 0.0, 0.0] },
        bias: if law.bias_affine { law.bias } else { [0.0; 3] },
    })
}

/// The joint that the actuator drives.
fn target(element: &Element, names: &Registry, model: &Model) -> Result<usize, MjcfError> {
    if element.attr("jointinparent").is_none() {
        return names.joints.required(element, "joint");
    }
    if element.attr("joint").is_some() {
        return Err(element.invalid("there are both 'joint' and 'jointinparent'"));
    }
    let joint = names.joints.required(element, "jointinparent")?;
    match model.joints[joint].kind {
        // the two transmissions differ only for joints with a quaternion
        JointType::Hinge | JointType::Slide => Ok(joint),
        JointType::Ball | JointType::Free => {
            let reason = "only hinge and slide joints can be driven in the parent's frame";
            Err(element.unsupported(Some("jointinparent"), reason))
        }
    }
}

/// Which part of the joint's range the control range is, if it is inherited: the innermost of `ctrlrange` and
/// `inheritrange` counts.
fn inherited_range(attrs: &Attrs) -> Result<Option<f64>, MjcfError> {
    if matches!(attrs.element.name.as_str(), "motor" | "velocity") {
        return Ok(None);
    }
    for element in attrs.chain().rev() {
        let part = Attrs::plain(element).number_or("inheritrange", 0.0)?;
        if part < 0.0 {
            return Err(element.invalid("inheritrange must not be negative"));
        }
        match (part > 0.0, element.attr("ctrlrange").is_some()) {
            (true, true) => return Err(element.invalid("there are both 'ctrlrange' and 'inheritrange'")),
            (true, false) => return Ok(Some(part)),
            (false, true) => return Ok(None),
            (false, false) => {}
        }
    }
    Ok(None)
}

/// Turns damping ratios of position servos into damping.
///
/// Critical damping is `2 sqrt(kp m)`, where `1/m` is the inverse mass seen through the gear. Source: MuJoCo,
/// `dampratio`.
pub(crate) fn resolve_damping(model: &mut Model, mass: &MassMatrix) {
    for actuator in &mut model.actuators {
        let (kp, ratio) = (actuator.gain[0], actuator.bias[2]);
        if kp != -actuator.bias[1] || ratio <= 0.0 {
            continue;
        }
        let joint = &model.joints[actuator.joint];
        let count = match joint.kind {
            JointType::Free => 6,
            JointType::Ball => 3,
            JointType::Slide | JointType::Hinge => 1,
        };
        let inverse = mass.inverse_form(joint.dof_adr, &actuator.gear[..count]);
        actuator.bias[2] = -2.0 * ratio * (kp / inverse.max(MIN_VAL)).max(0.0).sqrt();
    }
}

//! `<custom>` numbers, `<keyframe>` states and tendons that exert no force.

use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::math::{EPS, quat_norm};
use super::names::{Names, Registry};
use super::settings::{Settings, entries, sections};
use super::value::{Attrs, Tristate, numbers};
use crate::model::{JointType, Keyframe, Model, Quat};

/// More keyframes or numbers than this are a mistake in the file.
const LARGEST: usize = 100_000;

/// `<custom><numeric>` by name, in document order.
pub(crate) fn numerics(root: &Element) -> Result<Vec<(String, Vec<f64>)>, MjcfError> {
    let elements = || entries(root, "custom").filter(|e| e.name == "numeric");
    Names::collect("numeric", elements())?;
    elements()
        .map(|element| {
            let name = element.text("name").filter(|n| !n.is_empty());
            let name = name.ok_or_else(|| element.invalid("the attribute 'name' is missing"))?;
            let mut data = match element.attr("data") {
                Some(attr) => numbers(element, attr, 0, usize::MAX)?,
                None => Vec::new(),
            };
            if let Some(attr) = element.attr("size") {
                let size = usize::try_from(Attrs::plain(element).integer_or("size", 0)?).unwrap_or(usize::MAX);
                if size < data.len() || size > LARGEST {
                    let expected = format!("an integer from {} to {LARGEST}", data.len());
                    return Err(element.bad_value(attr, expected));
                }
                data.resize(size, 0.0);
            }
            if data.is_empty() {
                return Err(element.invalid("there are no numbers"));
            }
            Ok((name.to_owned(), data))
        })
        .collect()
}

/// `<keyframe>`: what a key leaves out is the reference configuration at rest.
pub(crate) fn keyframes(root: &Element, model: &Model) -> Result<Vec<Keyframe>, MjcfError> {
    let elements = || entries(root, "keyframe").filter(|e| e.name == "key");
    Names::collect("keyframe", elements())?;
    let reference = || Keyframe {
        name: String::new(),
        time: 0.0,
        qpos: model.qpos0.clone(),
        qvel: vec![0.0; model.nv],
        ctrl: vec![0.0; model.nu],
    };
    let mut keys = Vec::new();
    for element in elements() {
        let attrs = Attrs::plain(element);
        let mut key = reference();
        key.name = element.text("name").unwrap_or_default().to_owned();
        key.time = attrs.number_or("time", 0.0)?;
        for (name, values) in [("qpos", &mut key.qpos), ("qvel", &mut key.qvel), ("ctrl", &mut key.ctrl)] {
            let length = values.len();
            attrs.overlay(name, length, values)?;
        }
        for joint in &model.joints {
            let adr = match joint.kind {
                JointType::Free => joint.qpos_adr + 3,
                JointType::Ball => joint.qpos_adr,
                JointType::Slide | JointType::Hinge => continue,
            };
            let quat: Quat = std::array::from_fn(|i| key.qpos[adr + i]);
            let length = quat_norm(quat);
            if !(length >= EPS) {
                return Err(element.invalid(format!("the quaternion of the joint '{}' is zero", joint.name)));
            }
            key.qpos[adr..adr + 4].iter_mut().zip(quat).for_each(|(out, x)| *out = x / length);
        }
        keys.push(key);
    }
    // <size nkey> reserves room for more
    for section in sections(root, "size") {
        let Some(attr) = section.attr("nkey") else { continue };
        let count = usize::try_from(Attrs::plain(section).integer_or("nkey", 0)?).unwrap_or(usize::MAX);
        if count > LARGEST {
            return Err(section.bad_value(attr, format!("an integer from 0 to {LARGEST}")));
        }
        keys.resize_with(keys.len().max(count), reference);
    }
    Ok(keys)
}

/// Checks the tendons: those that exert no force are accepted and left out of the model.
pub(crate) fn check_tendons(
    root: &Element,
    defaults: &Defaults,
    names: &Registry,
    settings: &Settings,
) -> Result<(), MjcfError> {
    for element in entries(root, "tendon") {
        let attrs = defaults.attrs(element, None)?;
        let refuse = |attribute: &str| {
            let reason = "a tendon that exerts a force is not supported; only tendons without effect are accepted";
            Err(element.unsupported(Some(attribute), reason))
        };
        for name in ["stiffness", "damping", "frictionloss", "armature", "springyield"] {
            if attrs.partial_or(name, [0.0; 3])? != [0.0; 3] {
                return refuse(name);
            }
        }
        let range: [f64; 2] = attrs.array_or("range", [0.0; 2])?;
        match attrs.tristate("limited")? {
            Tristate::True => return refuse("limited"),
            Tristate::Auto if settings.autolimits && range[0] < range[1] => return refuse("range"),
            _ => {}
        }
        for part in &element.children {
            match part.name.as_str() {
                "joint" => names.joints.required(part, "joint")?,
                "site" => names.sites.required(part, "site")?,
                "geom" => names.geoms.required(part, "geom")?,
                _ => 0,
            };
        }
    }
    Ok(())
}

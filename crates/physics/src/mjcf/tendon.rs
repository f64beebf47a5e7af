//! `<tendon>`: linear combinations of joints. Strings through sites are taken only if they exert no force.

use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::limit::{check_limit, is_limited};
use super::names::Registry;
use super::settings::{Settings, entries};
use super::solver_params::{SOLIMP, SOLREF};
use super::value::{Attrs, numbers, polynomial};
use crate::model::{JointType, Model, Tendon, TendonKind};
use std::collections::BTreeSet;

/// Both ends of `springlength` when the file leaves them to the spring configuration.
const UNSET: f64 = -1.0;

/// All elements of `<tendon>` sections.
pub(crate) fn elements(root: &Element) -> impl Iterator<Item = &Element> {
    entries(root, "tendon")
}

/// Compiles all tendons, but for their inverse weights.
pub(crate) fn compile(
    root: &Element,
    defaults: &Defaults,
    names: &Registry,
    settings: &Settings,
    model: &Model,
) -> Result<Vec<Tendon>, MjcfError> {
    elements(root).map(|element| tendon(element, defaults, names, settings, model)).collect()
}

/// Checks the values of a `<tendon>` that sets defaults.
pub(crate) fn check_default(attrs: &Attrs) -> Result<(), MjcfError> {
    read(attrs).map(|_| ())
}

/// Everything but the path.
fn read(attrs: &Attrs) -> Result<Tendon, MjcfError> {
    let range = attrs.array_or("range", [0.0; 2])?;
    let force_range = attrs.array_or("actuatorfrcrange", [0.0; 2])?;
    let force_limited = is_limited(attrs, "actuatorfrclimited", force_range)?;
    let (stiffness, stiffness_poly) = polynomial(attrs, "stiffness")?;
    let (damping, damping_poly) = polynomial(attrs, "damping")?;
    Ok(Tendon {
        name: attrs.element.text("name").unwrap_or_default().to_owned(),
        kind: TendonKind::Spatial,
        limited: is_limited(attrs, "limited", range)?,
        range,
        margin: attrs.number_or("margin", 0.0)?,
        stiffness,
        stiffness_poly,
        spring_length: spring_length(attrs)?,
        damping,
        damping_poly,
        frictionloss: attrs.number_or("frictionloss", 0.0)?,
        armature: attrs.number_or("armature", 0.0)?,
        solref_limit: attrs.partial_or("solreflimit", SOLREF)?,
        solimp_limit: attrs.partial_or("solimplimit", SOLIMP)?,
        solref_friction: attrs.partial_or("solreffriction", SOLREF)?,
        solimp_friction: attrs.partial_or("solimpfriction", SOLIMP)?,
        actuator_force_range: force_limited.then_some(force_range),
        length0: 0.0,
        invweight0: 0.0,
        group: attrs.integer_or("group", 0)?,
    })
}

/// `springlength`: one number stands for both ends.
fn spring_length(attrs: &Attrs) -> Result<[f64; 2], MjcfError> {
    let mut length = [UNSET; 2];
    for element in attrs.chain() {
        let Some(attr) = element.attr("springlength") else { continue };
        match numbers(element, attr, 0, 2)?.as_slice() {
            [] => {}
            [both] => length = [*both; 2],
            ends => length.copy_from_slice(ends),
        }
    }
    Ok(length)
}

fn tendon(
    element: &Element,
    defaults: &Defaults,
    names: &Registry,
    settings: &Settings,
    model: &Model,
) -> Result<Tendon, MjcfError> {
    let attrs = defaults.attrs(element, None)?;
    let mut tendon = read(&attrs)?;
    check_limit(&attrs, "limited", "range", tendon.range, settings)?;
    let force_range = attrs.array_or("actuatorfrcrange", [0.0; 2])?;
    check_limit(&attrs, "actuatorfrclimited", "actuatorfrcrange", force_range, settings)?;
    let [low, high] = tendon.spring_length;
    if low > high {
        return Err(element.invalid(format!("'springlength' goes from {low} to {high}; the first must not be larger")));
    }
    if tendon.armature < 0.0 {
        return Err(element.invalid("armature must not be negative"));
    }
    if element.name == "fixed" {
        let path = path(element, names, model)?;
        let length = |qpos: &[f64]| path.iter().map(|(j, coef)| coef * qpos[model.joints[*j].qpos_adr]).sum::<f64>();
        tendon.length0 = length(&model.qpos0);
        if tendon.spring_length == [UNSET; 2] {
            tendon.spring_length = [length(&model.qpos_spring); 2];
        }
        tendon.kind = TendonKind::Fixed(path);
    } else {
        check_spatial(element, &attrs, &tendon, names)?;
        tendon.spring_length = [0.0; 2];
    }
    Ok(tendon)
}

/// Joints of a fixed tendon and their coefficients.
fn path(element: &Element, names: &Registry, model: &Model) -> Result<Vec<(usize, f64)>, MjcfError> {
    let mut path: Vec<(usize, f64)> = Vec::new();
    let mut known = BTreeSet::new();
    for part in &element.children {
        let joint = names.joints.required(part, "joint")?;
        let Some(attr) = part.attr("coef") else {
            return Err(part.invalid("the attribute 'coef' is missing"));
        };
        let coef = numbers(part, attr, 1, 1)?[0];
        let name = &model.joints[joint].name;
        if !matches!(model.joints[joint].kind, JointType::Hinge | JointType::Slide) {
            return Err(part.invalid(format!("the joint '{name}' is neither a hinge nor a slide")));
        }
        if !known.insert(joint) {
            return Err(part.invalid(format!("the joint '{name}' is repeated")));
        }
        path.push((joint, coef));
    }
    if path.is_empty() {
        return Err(element.invalid("the tendon runs over no joint"));
    }
    Ok(path)
}

/// A string through sites may exist but not exert a force.
fn check_spatial(element: &Element, attrs: &Attrs, tendon: &Tendon, names: &Registry) -> Result<(), MjcfError> {
    let refuse = |attribute: &str| {
        let reason =
            "a spatial tendon that exerts a force is not supported; use a fixed tendon or an equality constraint";
        let element = attrs.find(attribute).map_or(element, |(e, _)| e);
        Err(element.unsupported(Some(attribute), reason))
    };
    let constants = [
        ("stiffness", [tendon.stiffness].iter().chain(&tendon.stiffness_poly).any(|x| *x != 0.0)),
        ("damping", [tendon.damping].iter().chain(&tendon.damping_poly).any(|x| *x != 0.0)),
        ("frictionloss", tendon.frictionloss != 0.0),
        ("armature", tendon.armature != 0.0),
    ];
    if let Some((name, _)) = constants.iter().find(|(_, acts)| *acts) {
        return refuse(name);
    }
    if tendon.limited {
        return refuse(if element.attr("limited").is_some() { "limited" } else { "range" });
    }
    for part in &element.children {
        match part.name.as_str() {
            "site" => names.sites.required(part, "site")?,
            "geom" => names.geoms.required(part, "geom")?,
            _ => 0,
        };
    }
    Ok(())
}

/// Refuses a reference to a tendon that runs through sites.
pub(crate) fn require_fixed(element: &Element, attribute: &str, tendon: &Tendon) -> Result<(), MjcfError> {
    match tendon.kind {
        TendonKind::Fixed(_) => Ok(()),
        TendonKind::Spatial => {
            let reason = format!("'{}' is a spatial tendon, and those are not simulated", tendon.name);
            Err(element.unsupported(Some(attribute), reason))
        }
    }
}

/// The tendon's moment arms, as `(dof, coef)`; none for a string through sites.
pub(crate) fn moments(model: &Model, tendon: &Tendon) -> Vec<(usize, f64)> {
    match &tendon.kind {
        TendonKind::Fixed(path) => path.iter().map(|(j, coef)| (model.joints[*j].dof_adr, *coef)).collect(),
        TendonKind::Spatial => Vec::new(),
    }
}

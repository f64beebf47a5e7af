//! `<tendon>`: linear combinations of joints, and strings through sites.

use super::compiler::Settings;
use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::limit::{check_limit, is_limited};
use super::names::Registry;
use super::pose::Pose;
use super::room::Room;
use super::settings::entries;
use super::solver_params::{SOLIMP, SOLREF};
use super::tendon_path;
use super::value::{Attrs, numbers, polynomial};
use crate::model::{JointType, Model, Tendon, TendonKind};
use std::collections::BTreeSet;

/// Both ends of `springlength` when the file leaves them to the spring configuration.
const UNSET: f64 = -1.0;

/// All elements of `<tendon>` sections.
pub(crate) fn elements(root: &Element) -> impl Iterator<Item = &Element> {
    entries(root, "tendon")
}

/// Compiles all tendons, but for their inverse weights and the lengths of spatial ones.
pub(crate) fn compile(
    root: &Element,
    defaults: &Defaults,
    names: &Registry,
    settings: &Settings,
    model: &Model,
    room: &Room,
) -> Result<Vec<Tendon>, MjcfError> {
    elements(root).map(|element| tendon(element, defaults, names, settings, model, room)).collect()
}

/// Measures the spatial tendons in the reference configuration. Without a given length, their springs rest at the
/// length in the spring configuration.
pub(crate) fn measure(model: &mut Model, pose: &Pose) {
    let spatial: Vec<usize> =
        (0..model.tendons.len()).filter(|i| matches!(model.tendons[*i].kind, TendonKind::Spatial(_))).collect();
    let slack = |t: &Tendon| t.spring_length == [UNSET; 2];
    let rest = spatial.iter().any(|i| slack(&model.tendons[*i])).then(|| Pose::at(model, &model.qpos_spring));
    for i in spatial {
        let kind = &model.tendons[i].kind;
        let length0 = tendon_path::length(model, pose, kind);
        let at_rest = rest.as_ref().map(|pose| tendon_path::length(model, pose, kind));
        let tendon = &mut model.tendons[i];
        tendon.length0 = length0;
        if let Some(length) = at_rest.filter(|_| slack(tendon)) {
            tendon.spring_length = [length; 2];
        }
    }
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
        kind: TendonKind::Spatial(Vec::new()),
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
    room: &Room,
) -> Result<Tendon, MjcfError> {
    let attrs = defaults.attrs(element, None)?;
    let mut tendon = read(&attrs)?;
    check_limit(&attrs, "limited", "range", tendon.range, settings)?;
    let force_range = attrs.array_or("actuatorfrcrange", [0.0; 2])?;
    check_limit(&attrs, "actuatorfrclimited", "actuatorfrcrange", force_range, settings)?;
    if let Some([low, high]) = tendon.actuator_force_range.filter(|[low, high]| *low > 0.0 || *high < 0.0) {
        return Err(element.invalid(format!("'actuatorfrcrange' goes from {low} to {high}; it must contain 0")));
    }
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
        if let Some((owner, attr)) =
            attrs.find("width").filter(|_| !attrs.number_or("width", 1.0).is_ok_and(|w| w > 0.0))
        {
            return Err(owner.bad_value(attr, "a positive number"));
        }
        tendon.kind = tendon_path::read(element, names, model, tendon.armature > 0.0, room)?;
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

/// Moment arms of every tendon in the reference configuration, as `(dof, coef)`.
pub(crate) type Moments = Vec<Vec<(usize, f64)>>;

/// The moment arms of all tendons.
pub(crate) fn moments(model: &Model, pose: &Pose) -> Moments {
    let arms = |tendon: &Tendon| match &tendon.kind {
        TendonKind::Fixed(path) => path.iter().map(|(j, coef)| (model.joints[*j].dof_adr, *coef)).collect(),
        spatial => tendon_path::moments(model, pose, spatial),
    };
    model.tendons.iter().map(arms).collect()
}

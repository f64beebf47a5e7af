//! `<equality>`: what is kept equal, with what the file leaves out taken from the reference configuration.

use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::math::{EPS, IDENTITY, mul_quat, quat_norm, rotate, sub};
use super::names::{Names, Registry};
use super::pose::Pose;
use super::settings::entries;
use super::solver_params::{SOLIMP, SOLREF};
use super::value::Attrs;
use crate::model::{Equality, EqualityKind, JointType, Model, Quat, SolImp, SolRef, Vec3};

/// Attributes that all kinds of constraints share.
struct Common {
    active: bool,
    solref: SolRef,
    solimp: SolImp,
}

impl Common {
    fn read(attrs: &Attrs) -> Result<Self, MjcfError> {
        Ok(Common {
            active: attrs.flag_or("active", true)?,
            solref: attrs.partial_or("solref", SOLREF)?,
            solimp: attrs.partial_or("solimp", SOLIMP)?,
        })
    }
}

/// Checks the values of an `<equality>` that sets defaults.
pub(crate) fn check_default(attrs: &Attrs) -> Result<(), MjcfError> {
    Common::read(attrs).map(|_| ())
}

/// Compiles all constraints; `pose` is the reference configuration.
pub(crate) fn compile(
    root: &Element,
    defaults: &Defaults,
    names: &Registry,
    model: &Model,
    pose: &Pose,
) -> Result<Vec<Equality>, MjcfError> {
    Names::collect("constraint", entries(root, "equality"))?;
    let compile = |element: &Element| {
        let common = Common::read(&defaults.of_kind("equality", element)?)?;
        let kind = match element.name.as_str() {
            "connect" => connect(element, names, model, pose)?,
            "weld" => weld(element, names, model, pose)?,
            "joint" => joints(element, names, model)?,
            _ => tendons(element, names)?,
        };
        Ok(Equality {
            name: element.text("name").unwrap_or_default().to_owned(),
            kind,
            active: common.active,
            solref: common.solref,
            solimp: common.solimp,
        })
    };
    entries(root, "equality").map(compile).collect()
}

/// The two ends that a connect or weld joins.
enum Ends {
    Bodies([usize; 2]),
    Sites([usize; 2]),
}

/// Two bodies, of which the second may be left out for the world, or two sites. `of_bodies` are the attributes that
/// go with bodies only.
fn ends(element: &Element, names: &Registry, of_bodies: &[&str]) -> Result<Ends, MjcfError> {
    let given = |list: &[&str]| list.iter().any(|name| element.attr(name).is_some());
    if !given(&["site1", "site2"]) {
        let first = names.bodies.required(element, "body1")?;
        let second = if given(&["body2"]) { names.bodies.required(element, "body2")? } else { 0 };
        return different(element, [first, second]).map(Ends::Bodies);
    }
    if let Some(name) = of_bodies.iter().find(|name| element.attr(name).is_some()) {
        return Err(element.invalid(format!("there are both sites and '{name}', which is for bodies")));
    }
    different(element, [names.sites.required(element, "site1")?, names.sites.required(element, "site2")?])
        .map(Ends::Sites)
}

fn different(element: &Element, ends: [usize; 2]) -> Result<[usize; 2], MjcfError> {
    if ends[0] == ends[1] {
        return Err(element.invalid("both ends are the same"));
    }
    Ok(ends)
}

/// A point of the body `from` as seen from the body `to` in the reference configuration.
fn carried(pose: &Pose, from: usize, point: Vec3, to: usize) -> Vec3 {
    let frame = &pose.body[to];
    rotate(conjugate(frame.quat), sub(pose.body[from].point(point), frame.pos))
}

fn conjugate(q: Quat) -> Quat {
    [q[0], -q[1], -q[2], -q[3]]
}

fn connect(element: &Element, names: &Registry, model: &Model, pose: &Pose) -> Result<EqualityKind, MjcfError> {
    Ok(match ends(element, names, &["body1", "body2", "anchor"])? {
        Ends::Sites(sites) => {
            let anchors = sites.map(|s| model.sites[s].pos);
            EqualityKind::Connect { bodies: sites.map(|s| model.sites[s].body), sites: Some(sites), anchors }
        }
        Ends::Bodies(bodies) => {
            let Some(anchor) = Attrs::plain(element).array("anchor")? else {
                return Err(element.invalid("the attribute 'anchor' is missing"));
            };
            let anchors = [anchor, carried(pose, bodies[0], anchor, bodies[1])];
            EqualityKind::Connect { bodies, sites: None, anchors }
        }
    })
}

fn weld(element: &Element, names: &Registry, model: &Model, pose: &Pose) -> Result<EqualityKind, MjcfError> {
    let attrs = Attrs::plain(element);
    let torquescale = attrs.number_or("torquescale", 1.0)?;
    Ok(match ends(element, names, &["body1", "body2", "anchor", "relpose"])? {
        Ends::Sites(sites) => EqualityKind::Weld {
            bodies: sites.map(|s| model.sites[s].body),
            sites: Some(sites),
            anchors: sites.map(|s| model.sites[s].pos),
            quats: sites.map(|s| model.sites[s].quat),
            torquescale,
        },
        Ends::Bodies(bodies) => {
            // the anchor is given in the second body's frame, the pose of the second body in the first's
            let anchor = attrs.array_or("anchor", [0.0; 3])?;
            let [x, y, z, quat @ ..]: [f64; 7] = attrs.array_or("relpose", [0.0; 7])?;
            let (first, quat) = if quat == [0.0; 4] {
                let relative = mul_quat(conjugate(pose.body[bodies[0]].quat), pose.body[bodies[1]].quat);
                (carried(pose, bodies[1], anchor, bodies[0]), relative)
            } else {
                let length = quat_norm(quat);
                if !(length >= EPS) || !length.is_finite() {
                    return Err(element.invalid("the quaternion of 'relpose' is too small or too large"));
                }
                ([x, y, z], quat.map(|c| c / length))
            };
            EqualityKind::Weld { bodies, sites: None, anchors: [first, anchor], quats: [quat, IDENTITY], torquescale }
        }
    })
}

/// The object that leads, if any.
fn second(element: &Element, names: &Names, attribute: &str, first: usize) -> Result<Option<usize>, MjcfError> {
    if element.attr(attribute).is_none() {
        return Ok(None);
    }
    let second = names.required(element, attribute)?;
    different(element, [first, second])?;
    Ok(Some(second))
}

fn polycoef(element: &Element) -> Result<[f64; 5], MjcfError> {
    Attrs::plain(element).partial_or("polycoef", [0.0, 1.0, 0.0, 0.0, 0.0])
}

fn joints(element: &Element, names: &Registry, model: &Model) -> Result<EqualityKind, MjcfError> {
    let joint1 = names.joints.required(element, "joint1")?;
    let joint2 = second(element, &names.joints, "joint2", joint1)?;
    for joint in [Some(joint1), joint2].into_iter().flatten().map(|j| &model.joints[j]) {
        if !matches!(joint.kind, JointType::Hinge | JointType::Slide) {
            return Err(element.invalid(format!("the joint '{}' is neither a hinge nor a slide", joint.name)));
        }
    }
    Ok(EqualityKind::Joint { joint1, joint2, polycoef: polycoef(element)? })
}

fn tendons(element: &Element, names: &Registry) -> Result<EqualityKind, MjcfError> {
    let tendon1 = names.tendons.required(element, "tendon1")?;
    let tendon2 = second(element, &names.tendons, "tendon2", tendon1)?;
    Ok(EqualityKind::Tendon { tendon1, tendon2, polycoef: polycoef(element)? })
}

//! The target of an actuator: a joint, a tendon, sites, or the contacts of a body.

use super::error::MjcfError;
use super::math::{Frame, axes, cross, dot, rotate, scale, sub};
use super::names::Registry;
use super::pose::{Pose, motion};
use super::room::Room;
use super::tendon::Moments;
use super::value::Attrs;
use crate::model::{Actuator, JointType, Model, Transmission, Vec3};
use std::collections::BTreeMap;

/// Memory of the kernels for a moment arm: its place, and two numbers for every lane.
const ARM: usize = 160;

/// Attributes that name the target, each with those that belong to it.
const TARGETS: [(&str, &[&str]); 6] = [
    ("joint", &[]),
    ("jointinparent", &[]),
    ("tendon", &[]),
    ("body", &[]),
    ("site", &["refsite"]),
    ("cranksite", &["slidersite", "cranklength"]),
];

/// Reads the target that the actuator drives.
pub(crate) fn target(attrs: &Attrs, names: &Registry) -> Result<Transmission, MjcfError> {
    let element = attrs.element;
    let given: Vec<&str> = TARGETS.map(|(name, _)| name).into_iter().filter(|n| element.attr(n).is_some()).collect();
    let target = match given.as_slice() {
        [] if element.name == "adhesion" => return Err(element.invalid("the attribute 'body' is missing")),
        [] => return Err(element.invalid("the attribute 'joint' is missing")),
        [one] => *one,
        several => return Err(element.invalid(format!("there are both '{}'", several.join("' and '")))),
    };
    for (owner, own) in TARGETS.iter().filter(|(name, _)| *name != target) {
        if let Some(name) = own.iter().find(|name| element.attr(name).is_some()) {
            return Err(element.invalid(format!("'{name}' needs '{owner}', but there is '{target}'")));
        }
    }
    let site = |attribute: &str| names.sites.required(element, attribute);
    Ok(match target {
        "joint" => Transmission::Joint(names.joints.required(element, target)?),
        "jointinparent" => Transmission::JointInParent(names.joints.required(element, target)?),
        "tendon" => Transmission::Tendon(names.tendons.required(element, target)?),
        "body" => Transmission::Body(names.bodies.required(element, target)?),
        "site" => {
            let given = element.text("refsite").is_some_and(|s| !s.is_empty());
            let reference = if given { Some(site("refsite")?) } else { None };
            Transmission::Site { site: site("site")?, reference }
        }
        _ => {
            let rod = attrs.number_or("cranklength", 0.0)?;
            if rod <= 0.0 {
                return Err(element.invalid(format!("'cranklength' is {rod}; it must be positive")));
            }
            Transmission::SliderCrank { crank: site("cranksite")?, slider: site("slidersite")?, rod }
        }
    })
}

/// Takes room for the moment arms of a drive, or of adhesion, which may act on everything.
pub(crate) fn take_room(attrs: &Attrs, model: &Model, actuator: &Actuator, room: &Room) -> Result<(), MjcfError> {
    if let Transmission::Body(_) = actuator.transmission {
        return room.take_for(attrs.element, model.nv + model.geoms.len(), ARM);
    }
    let Some((first, second)) = actuator.sites() else { return Ok(()) };
    let dofs = |site: usize| model.dofs_of_body(model.sites[site].body).len();
    room.take_for(attrs.element, first.map_or(0, dofs) + dofs(second) + 16, ARM)
}

/// The actuator's moment arms in the reference configuration, as `(dof, arm)`.
pub(crate) fn moments(model: &Model, pose: &Pose, actuator: &Actuator, tendons: &Moments) -> Vec<(usize, f64)> {
    let gear = actuator.gear;
    match actuator.transmission {
        Transmission::Tendon(t) => tendons[t].iter().map(|(dof, arm)| (*dof, arm * gear[0])).collect(),
        // MuJoCo looks for no contacts there
        Transmission::Body(_) => Vec::new(),
        Transmission::Joint(j) | Transmission::JointInParent(j) => {
            let joint = &model.joints[j];
            let mut arms = gear[..joint.kind.dofs()].to_vec();
            // a ball joint is at its identity; the orientation of a free joint turns the torque into its own axes
            if joint.kind == JointType::Free && matches!(actuator.transmission, Transmission::JointInParent(_)) {
                let [w, x, y, z] = model.bodies[joint.body].quat;
                arms[3..].copy_from_slice(&rotate([w, -x, -y, -z], [gear[3], gear[4], gear[5]]));
            }
            arms.into_iter().enumerate().map(|(k, arm)| (joint.dof_adr + k, arm)).collect()
        }
        Transmission::Site { site, reference } => {
            let (end, other) = (Place::new(model, pose, site), reference.map(|s| Place::new(model, pose, s)));
            let along = axes(other.as_ref().unwrap_or(&end).frame.quat);
            let world = |g: &[f64]| [0, 1, 2].map(|i| (0..3).map(|k| along[k][i] * g[k]).sum());
            let (force, torque) = (world(&gear[..3]), world(&gear[3..]));
            let other = other.unwrap_or(Place { body: 0, frame: Frame::IDENTITY });
            between(model, pose, &[other, end], [(scale(force, -1.0), scale(torque, -1.0)), (force, torque)])
        }
        Transmission::SliderCrank { crank, slider, rod } => {
            let ends = [slider, crank].map(|s| Place::new(model, pose, s));
            let axis = axes(ends[0].frame.quat)[2];
            let apart = sub(ends[1].frame.pos, ends[0].frame.pos);
            let along = dot(apart, axis);
            let square = along * along + rod * rod - dot(apart, apart);
            let inverse = if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 };
            let share = 1.0 - along * inverse;
            let force = [0, 1, 2].map(|i| (share * axis[i] + inverse * apart[i]) * gear[0]);
            let turn = cross(axis, scale(apart, share * gear[0]));
            between(model, pose, &ends, [(scale(force, -1.0), turn), (force, [0.0; 3])])
        }
    }
}

/// A site in the world.
struct Place {
    body: usize,
    frame: Frame,
}

impl Place {
    fn new(model: &Model, pose: &Pose, site: usize) -> Self {
        let body = model.sites[site].body;
        let (pos, quat) = model.site_frame(site);
        Place { body, frame: pose.body[body].compose(&Frame { pos, quat }) }
    }
}

/// Moment arms of forces and torques at two places, for every dof that moves one and not the other.
fn between(model: &Model, pose: &Pose, ends: &[Place; 2], loads: [(Vec3, Vec3); 2]) -> Vec<(usize, f64)> {
    let mut arms: BTreeMap<usize, f64> = BTreeMap::new();
    let dofs = model.dofs_between([ends[0].body, ends[1].body]);
    for ((dofs, end), (force, torque)) in dofs.into_iter().zip(ends).zip(loads) {
        for dof in dofs {
            let motion = motion(model, pose, dof, end.frame.pos);
            *arms.entry(dof).or_default() += dot(motion.linear, force) + dot(motion.angular, torque);
        }
    }
    arms.into_iter().collect()
}

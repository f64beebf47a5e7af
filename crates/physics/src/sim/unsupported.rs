//! Refuses by name what the kernels do not support.

use super::options::SimError;
use super::tendon::chains;
use crate::model::{Actuator, Body, Joint, JointType, Model, Tendon, Transmission};

/// Refuses a model that would not be simulated as in MuJoCo. Contacts are checked when their list is created.
pub(crate) fn check(model: &Model) -> Result<(), SimError> {
    let refuse = |(what, remedy): (String, &str)| {
        Err(SimError::Unsupported { model: model.name.clone(), what, remedy: remedy.into() })
    };
    let found = model
        .bodies
        .iter()
        .find_map(|b| body(model, b))
        .or_else(|| model.tendons.iter().enumerate().find_map(|(i, t)| tendon(model, i, t)))
        .or_else(|| model.actuators.iter().enumerate().find_map(|(i, a)| actuator(model, i, a)));
    found.map_or(Ok(()), refuse)
}

type Refusal = Option<(String, &'static str)>;

fn body(model: &Model, body: &Body) -> Refusal {
    let joints = &model.joints[body.joint_start..body.joint_start + body.joint_count];
    joints.iter().enumerate().find_map(|(i, j)| joint(model, body, joints, i, j))
}

fn joint(model: &Model, body: &Body, siblings: &[Joint], i: usize, joint: &Joint) -> Refusal {
    let name = &joint.name;
    match joint.kind {
        JointType::Free if siblings.len() > 1 || body.parent != 0 => {
            return Some((
                format!("free joint '{name}' below another joint"),
                "free joints belong on top-level bodies",
            ));
        }
        JointType::Ball if i + 1 < siblings.len() => {
            let what = format!("ball joint '{name}' followed by another joint of its body");
            return Some((what, "list the ball joint last"));
        }
        _ => {}
    }
    if joint.stiffness_poly != [0.0; 2] || model.dofs[joint.dof_adr].damping_poly != [0.0; 2] {
        return Some((format!("polynomial stiffness or damping of joint '{name}'"), "use the linear term"));
    }
    None
}

/// A name in quotes; many tendons and actuators have none.
fn label(name: &str, index: usize) -> String {
    if name.is_empty() { format!("number {index}") } else { format!("'{name}'") }
}

fn tendon(model: &Model, index: usize, tendon: &Tendon) -> Refusal {
    let name = label(&tendon.name, index);
    if tendon.stiffness_poly != [0.0; 2] || tendon.damping_poly != [0.0; 2] {
        return Some((format!("polynomial stiffness or damping of tendon {name}"), "use the linear term"));
    }
    if tendon.armature == 0.0 {
        return None;
    }
    let what = |where_: &str| Some((format!("armature of tendon {name} {where_}"), "give the joints armature"));
    if chains(model, tendon).is_none() {
        return what("on several branches and on what carries them");
    }
    if model.opt.noslip_iterations > 0 { what("with noslip_iterations") } else { None }
}

fn actuator(model: &Model, index: usize, a: &Actuator) -> Refusal {
    let name = label(&a.name, index);
    match a.transmission {
        Transmission::Tendon(_) | Transmission::Site { .. } | Transmission::SliderCrank { .. } => {}
        Transmission::Body(b) => return adhesion(model, &name, a, b),
        Transmission::Joint(j) | Transmission::JointInParent(j) => {
            let joint = &model.joints[j];
            let scalar = matches!(joint.kind, JointType::Hinge | JointType::Slide);
            if !scalar && matches!(a.transmission, Transmission::JointInParent(_)) {
                return Some((format!("jointinparent of actuator {name}"), "use joint"));
            }
            if !scalar && a.is_fed_back() {
                let what = format!("actuator {name} with position or velocity feedback on joint '{}'", joint.name);
                return Some((what, "only hinge and slide joints can be fed back"));
            }
        }
    }
    None
}

/// Contacts that an actuator pulls at.
fn adhesion(model: &Model, name: &str, a: &Actuator, body: usize) -> Refusal {
    let body = label(&model.bodies[body].name, body);
    if a.is_fed_back() {
        let what = format!("actuator {name} with position or velocity feedback on the contacts of body {body}");
        return Some((what, "use a constant gain"));
    }
    // MuJoCo's adhesion also acts on contacts in the gap, which are not looked for
    if model.geoms.iter().map(|g| g.gap).chain(model.pairs.iter().map(|p| p.gap)).any(|gap| gap != 0.0) {
        return Some((format!("actuator {name} on the contacts of body {body}, with gaps"), "set gap to 0"));
    }
    if let Some(joint) = model.joints.iter().find(|j| j.actuator_force_range.is_some()) {
        let what =
            format!("actuator {name} on the contacts of body {body} with actuatorfrcrange of joint '{}'", joint.name);
        return Some((what, "remove actuatorfrcrange"));
    }
    None
}

//! `<actuator>`: motors, servos and muscles on joints, tendons and sites.

use super::actuator_params::{ActuatorParams, Limits};
use super::compiler::Settings;
use super::compiler::Tristate;
use super::defaults::Defaults;
use super::document::Element;
use super::error::MjcfError;
use super::limit::{check_limit, is_limited};
use super::mass_matrix::MassMatrix;
use super::math::MIN_VAL;
use super::muscle;
use super::names::Registry;
use super::pose::Pose;
use super::room::Room;
use super::settings::entries;
use super::tendon::Moments;
use super::transmission;
use super::value::{Attrs, polynomial};
use crate::model::{Actuator, Dynamics, JointType, Model, Muscle, Transmission};

/// All elements of `<actuator>` sections.
pub(crate) fn elements(root: &Element) -> impl Iterator<Item = &Element> {
    entries(root, "actuator")
}

/// Checks the values of an actuator element that sets defaults.
pub(crate) fn check_default(attrs: &Attrs) -> Result<(), MjcfError> {
    polynomial(attrs, "damping")?;
    attrs.array::<1>("armature")?;
    read(attrs, &[]).map(|_| ())
}

/// Everything that does not depend on the rest of the model.
fn read(attrs: &Attrs, ends: &[usize]) -> Result<Actuator, MjcfError> {
    let params = ActuatorParams::compile(attrs, ends)?;
    let Limits { ctrl_limited, ctrl_range, act_limited, act_range, act_early } = Limits::read(attrs)?;
    let force_range = attrs.array_or("forcerange", [0.0; 2])?;
    Ok(Actuator {
        name: attrs.element.text("name").unwrap_or_default().to_owned(),
        transmission: Transmission::Joint(0),
        gear: attrs.partial_or("gear", [1.0, 0.0, 0.0, 0.0, 0.0, 0.0])?,
        ctrl_limited: applies(ctrl_limited, ctrl_range),
        ctrl_range,
        force_limited: is_limited(attrs, "forcelimited", force_range)?,
        force_range,
        gain: params.gain(),
        bias: params.bias(),
        gain_muscle: None,
        bias_muscle: None,
        dynamics: params.dynamics(),
        act: None,
        act_limited: applies(act_limited, act_range),
        act_range,
        act_early,
    })
}

/// Whether a range applies: as switched, or as it is given when the switch is `auto`.
fn applies(switch: Tristate, range: [f64; 2]) -> bool {
    switch == Tristate::True || (switch == Tristate::Auto && range[0] < range[1])
}

/// Compiles all actuators into the model, with what they add to joints and tendons.
pub(crate) fn compile(
    root: &Element,
    defaults: &Defaults,
    names: &Registry,
    settings: &Settings,
    model: &mut Model,
    room: &Room,
) -> Result<(), MjcfError> {
    for element in elements(root) {
        let (attrs, ends) = defaults.actuator(element)?;
        let mut actuator = actuator(&attrs, ends, names, settings, model)?;
        if actuator.dynamics != Dynamics::None {
            actuator.act = Some(model.na);
            model.na += 1;
        }
        reflect(&attrs, &actuator, model)?;
        transmission::take_room(&attrs, model, &actuator, room)?;
        model.actuators.push(actuator);
    }
    model.nu = model.actuators.len();
    Ok(())
}

fn actuator(
    attrs: &Attrs,
    ends: &[usize],
    names: &Registry,
    settings: &Settings,
    model: &Model,
) -> Result<Actuator, MjcfError> {
    let element = attrs.element;
    let mut actuator = read(attrs, ends)?;
    actuator.transmission = transmission::target(attrs, names)?;
    check_limit(attrs, "forcelimited", "forcerange", actuator.force_range, settings)?;
    inherit_range(attrs, ends, &mut actuator, model)?;
    let Limits { ctrl_limited, act_limited, .. } = Limits::read(attrs)?;
    check_range(attrs, ("ctrllimited", ctrl_limited), ("ctrlrange", actuator.ctrl_range), settings)?;
    check_range(attrs, ("actlimited", act_limited), ("actrange", actuator.act_range), settings)?;
    let muscles = ActuatorParams::compile(attrs, ends)?.muscles();
    if muscles.iter().any(Option::is_some) {
        let range = settings.lengthrange.of(attrs, actuator.transmission, model)?;
        let of = |numbers: Option<_>| numbers.map(|n| muscle::muscle(element, &n, range)).transpose();
        (actuator.gain_muscle, actuator.bias_muscle) = (of(muscles[0])?, of(muscles[1])?);
    }
    let stateful = actuator.dynamics != Dynamics::None;
    if actuator.act_limited && !stateful {
        return Err(element.invalid("there is a range of activations, but no activation: dyntype is none"));
    }
    if let Some((owner, attr)) = attrs.find("actdim") {
        let expected = i32::from(stateful);
        if ![-1, expected].contains(&attrs.integer_or("actdim", -1)?) {
            return Err(owner.bad_value(attr, format!("{expected}, the number of activations of this actuator")));
        }
    }
    Ok(actuator)
}

/// Checks a range of the model, as [`check_limit`] does, with the switch that shortcuts may set.
fn check_range(
    attrs: &Attrs,
    (switch, state): (&str, Tristate),
    (name, range): (&str, [f64; 2]),
    settings: &Settings,
) -> Result<(), MjcfError> {
    if state == Tristate::Auto && range != [0.0; 2] && !settings.of(attrs.element).autolimits {
        let message = format!("there is '{name}' but not '{switch}', and the compiler's autolimits is false");
        return Err(attrs.element.invalid(message));
    }
    if applies(state, range) && !(range[0] < range[1]) {
        let [low, high] = range;
        return Err(attrs.element.invalid(format!("'{name}' goes from {low} to {high}; the first must be smaller")));
    }
    Ok(())
}

/// Takes the range of the joint or tendon over, if `inheritrange` says so: for the control of a position servo, or for
/// the activation of an integrated one.
fn inherit_range(attrs: &Attrs, ends: &[usize], actuator: &mut Actuator, model: &Model) -> Result<(), MjcfError> {
    let element = attrs.element;
    let params = ActuatorParams::compile(attrs, ends)?;
    let part = params.inherited_range;
    if !params.is_position_servo() || part == 0.0 {
        return Ok(());
    }
    let of_activation = actuator.dynamics == Dynamics::Integrator;
    let scalar = |j: usize| matches!(model.joints[j].kind, JointType::Hinge | JointType::Slide);
    let (range, name) = match actuator.transmission {
        Transmission::Joint(j) if scalar(j) => (model.joints[j].range, &model.joints[j].name),
        Transmission::Tendon(t) => (model.tendons[t].range, &model.tendons[t].name),
        _ => {
            return Err(
                element.invalid("'inheritrange' needs a hinge, a slide or a tendon, given as 'joint' or 'tendon'")
            );
        }
    };
    let [low, high] = range;
    if !(low < high) {
        return Err(element.invalid(format!("'inheritrange' needs a range of '{name}'")));
    }
    let (middle, radius) = ((low + high) / 2.0, part * (high - low) / 2.0);
    let range = [middle - radius, middle + radius];
    let Limits { ctrl_limited, act_limited, .. } = Limits::read(attrs)?;
    if of_activation {
        (actuator.act_range, actuator.act_limited) = (range, applies(act_limited, range));
    } else {
        (actuator.ctrl_range, actuator.ctrl_limited) = (range, applies(ctrl_limited, range));
    }
    Ok(())
}

/// Adds the damping and armature of an actuator to its joint or tendon, times the square of the gear.
fn reflect(attrs: &Attrs, actuator: &Actuator, model: &mut Model) -> Result<(), MjcfError> {
    let (damping, damping_poly) = polynomial(attrs, "damping")?;
    let armature = attrs.number_or("armature", 0.0)?;
    if armature < 0.0 {
        return Err(attrs.element.invalid("armature must not be negative"));
    }
    let given = [("damping", damping != 0.0 || damping_poly != [0.0; 2]), ("armature", armature != 0.0)];
    let square = actuator.gear[0] * actuator.gear[0];
    let add = |to: (&mut f64, &mut f64, &mut [f64; 2])| {
        *to.0 += armature * square;
        *to.1 += damping * square;
        to.2.iter_mut().zip(damping_poly).for_each(|(sum, x)| *sum += x * square);
    };
    match actuator.transmission {
        Transmission::Joint(j) | Transmission::JointInParent(j) => {
            let joint = &model.joints[j];
            for dof in &mut model.dofs[joint.dof_adr..joint.dof_adr + joint.kind.dofs()] {
                add((&mut dof.armature, &mut dof.damping, &mut dof.damping_poly));
                dof.geared |= given.iter().any(|(_, given)| *given);
            }
        }
        Transmission::Tendon(t) => {
            let tendon = &mut model.tendons[t];
            add((&mut tendon.armature, &mut tendon.damping, &mut tendon.damping_poly));
        }
        Transmission::Site { .. } | Transmission::SliderCrank { .. } | Transmission::Body(_) => {
            if let Some((name, _)) = given.iter().find(|(_, given)| *given) {
                return Err(attrs.element.invalid(format!("'{name}' needs a joint or a tendon")));
            }
        }
    }
    Ok(())
}

/// Turns damping ratios of position servos into damping, and scales of muscles into forces.
///
/// Critical damping is `2 sqrt(kp m)`, where `1/m` is the inverse mass seen through the gear. Source: MuJoCo,
/// `dampratio`. A muscle without a force has its scale over the acceleration that a unit of its force causes.
pub(crate) fn resolve(model: &mut Model, pose: &Pose, mass: &MassMatrix, tendons: &Moments) {
    for i in 0..model.actuators.len() {
        let actuator = &model.actuators[i];
        let scaled = |m: &Option<Muscle>| m.is_some_and(|m| m.force < 0.0);
        if scaled(&actuator.gain_muscle) || scaled(&actuator.bias_muscle) {
            let acceleration = mass.inverse_norm(&transmission::moments(model, pose, actuator, tendons)).max(MIN_VAL);
            let actuator = &mut model.actuators[i];
            for muscle in [&mut actuator.gain_muscle, &mut actuator.bias_muscle].into_iter().flatten() {
                if muscle.force < 0.0 {
                    muscle.force = -muscle.force / acceleration;
                }
            }
        }
        let actuator = &model.actuators[i];
        let (kp, ratio) = (actuator.gain[0], actuator.bias[2]);
        if kp != -actuator.bias[1] || ratio <= 0.0 {
            continue;
        }
        let inverse = mass.inverse_form(&transmission::moments(model, pose, actuator, tendons));
        let inertia = if inverse > MIN_VAL { 1.0 / inverse } else { 0.0 };
        model.actuators[i].bias[2] = -2.0 * ratio * (kp * inertia).max(0.0).sqrt();
    }
}

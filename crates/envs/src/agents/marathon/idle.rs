//! Actuators that apply no force: the actions of a role without a body.

use marathon_physics::mjcf::MjcfError;
use marathon_physics::spec::{Actuator, ModelSpec, Tendon};

/// Adds motors with these names after the model's own. They act on a tendon that exerts no force on `joint`.
pub(super) fn add_actuators<S: AsRef<str>>(spec: &mut ModelSpec, joint: &str, names: &[S]) -> Result<(), MjcfError> {
    spec.add(Tendon::fixed("idle").joint(joint, 0.0))?;
    for name in names {
        spec.add(Actuator::motor(name.as_ref()).tendon("idle").ctrl_range([-1.0, 1.0]))?;
    }
    Ok(())
}

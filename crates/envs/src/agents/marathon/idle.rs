//! Actuators that apply no force: the actions of a role without a body.

use std::fmt::Write;

/// MJCF of motors with these names. They act on a tendon that exerts no force on `joint`.
pub(super) fn actuators(joint: &str, names: &[&str]) -> String {
    let mut out =
        format!("<tendon><fixed name=\"idle\"><joint joint=\"{joint}\" coef=\"0\"/></fixed></tendon>\n<actuator>");
    for name in names {
        // writing to a string cannot fail
        let _ = write!(out, "<motor name=\"{name}\" tendon=\"idle\" ctrllimited=\"true\" ctrlrange=\"-1 1\"/>");
    }
    out + "</actuator>\n"
}

/// The model with additional elements.
pub(super) fn extended(model: &str, elements: &str) -> String {
    format!("{}{elements}</mujoco>\n", model.trim_end().trim_end_matches("</mujoco>"))
}

//! Actuators that move nothing: the actions of a role without a body.

use std::fmt::Write;

/// MJCF of motors of these names, behind a model's own, on a tendon that does not pull at one of its joints.
pub(super) fn actuators(joint: &str, names: &[&str]) -> String {
    let mut out =
        format!("<tendon><fixed name=\"idle\"><joint joint=\"{joint}\" coef=\"0\"/></fixed></tendon>\n<actuator>");
    for name in names {
        // writing to a string cannot fail
        let _ = write!(out, "<motor name=\"{name}\" tendon=\"idle\" ctrllimited=\"true\" ctrlrange=\"-1 1\"/>");
    }
    out + "</actuator>\n"
}

/// A model with more elements.
pub(super) fn extended(model: &str, elements: &str) -> String {
    format!("{}{elements}</mujoco>\n", model.trim_end().trim_end_matches("</mujoco>"))
}

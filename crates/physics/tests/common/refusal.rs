//! Models that are refused, and the message.
use marathon_physics::Model;

/// Checks that a model with files is refused by a message with these parts.
#[track_caller]
pub fn names(xml: &str, files: &dyn Fn(&str) -> Result<Vec<u8>, String>, parts: &[&str]) {
    has(&Model::from_xml_str_with(xml, "bad.xml", files).unwrap_err().to_string(), parts, xml);
}

/// The same of a model without files.
#[track_caller]
pub fn check(xml: &str, parts: &[&str]) {
    has(&message(xml), parts, xml);
}

#[track_caller]
fn has(message: &str, parts: &[&str], xml: &str) {
    for part in parts {
        assert!(message.contains(part), "'{part}' is missing in\n  {message}\nfor\n  {xml}");
    }
}

/// The message for a model given as text.
pub fn message(xml: &str) -> String {
    match Model::from_xml_str(xml, "bad.xml") {
        Ok(_) => panic!("accepted: {xml}"),
        Err(error) => error.to_string(),
    }
}

/// A model around something in a body that has a geom of its own.
pub fn in_body(content: &str) -> String {
    format!(
        "<mujoco>\n<worldbody>\n<body name=\"b\">\n<geom name=\"g\" size=\"1\"/><joint name=\"j\"/><site name=\"s\"/>\n{content}\n</body>\n</worldbody>\n</mujoco>"
    )
}

/// A model around a section next to a world with a body, joint, geom and site.
pub fn with_section(content: &str) -> String {
    in_body("").replace("</worldbody>", &format!("</worldbody>\n{content}"))
}

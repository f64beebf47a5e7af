//! Models that are refused, and the message.

use marathon_physics::Model;

/// Checks that a model with files is refused by a message with these parts.
pub fn names(xml: &str, files: &dyn Fn(&str) -> Result<Vec<u8>, String>, parts: &[&str]) {
    let message = Model::from_xml_str_with(xml, "bad.xml", files).unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "'{part}' is missing in {message}");
    }
}

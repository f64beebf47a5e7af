//! Shared by the tests of configurations that are valid.

use marathon_config::{Loaded, parse};
use std::path::Path;

/// Settings of an agent from a file's text.
pub fn read(text: &str, agent: &str) -> Loaded {
    parse(Path::new("test.yaml"), text.as_bytes(), agent).unwrap_or_else(|e| panic!("{e}"))
}

//! Configuration files on disk.

use crate::error::RunError;
use marathon_config::{Loaded, parse};
use std::path::Path;

/// Reads what a file says about an agent, which may go by any of its names.
///
/// # Errors
/// If the file cannot be read, or is no configuration for the agent; see [`parse`].
pub fn load(path: &Path, agent: &str) -> Result<Loaded, RunError> {
    let bytes = std::fs::read(path).map_err(RunError::io(path, "read"))?;
    Ok(parse(path, &bytes, agent)?)
}

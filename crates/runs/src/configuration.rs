//! Configuration files on disk.

use crate::error::RunError;
use marathon_config::{Loaded, parse, parse_roles};
use marathon_learn::RoleConfig;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads what a file says about an agent, which may go by any of its names.
///
/// # Errors
/// If the file cannot be read, or is no configuration for the agent; see [`parse`].
pub fn load(path: &Path, agent: &str) -> Result<Loaded, RunError> {
    Ok(parse(path, &read(path)?, agent)?)
}

/// Reads what a file says about roles of a task but the first.
///
/// # Errors
/// If the file cannot be read, or speaks of a role that there is not; see [`parse_roles`].
pub fn load_roles(path: &Path, task: &str, roles: &[&str]) -> Result<BTreeMap<String, RoleConfig>, RunError> {
    Ok(parse_roles(path, &read(path)?, task, roles)?)
}

fn read(path: &Path) -> Result<Vec<u8>, RunError> {
    std::fs::read(path).map_err(RunError::io(path, "read"))
}

//! Configuration files on disk.

use crate::error::RunError;
use marathon_config::{Loaded, parse, parse_roles};
use marathon_envs::registry;
use marathon_learn::RoleConfig;
use marathon_physics::budget;
use marathon_physics::hint::{did_you_mean, nearest};
use std::collections::BTreeMap;
use std::path::Path;

/// Reads the configuration of an agent from a file, which may use any of the agent's names.
///
/// # Errors
/// If the file cannot be read, or is not a configuration for the agent; see [`parse`].
pub fn load(path: &Path, agent: &str) -> Result<Loaded, RunError> {
    let loaded = parse(path, &read(path)?, agent)?;
    // tasks of a front end are not registered and take no options
    if let Ok(agent) = registry::agent(agent) {
        let known: Vec<&str> = agent.options().iter().map(|option| option.name).collect();
        if let Some((name, value)) = loaded.options.iter().find(|(name, _)| !known.contains(&name.as_str())) {
            let near = did_you_mean(nearest(name, known.iter().copied()));
            let expected = format!("an option of {}: {}{near}", agent.facts().id, known.join(", "));
            return Err(RunError::file(path, format!("marathon.options.{name}"), value, expected));
        }
    }
    Ok(loaded)
}

/// Reads the configuration of all roles but the first.
///
/// # Errors
/// If the file cannot be read, or names a role that does not exist; see [`parse_roles`].
pub fn load_roles(path: &Path, task: &str, roles: &[&str]) -> Result<BTreeMap<String, RoleConfig>, RunError> {
    Ok(parse_roles(path, &read(path)?, task, roles)?)
}

fn read(path: &Path) -> Result<Vec<u8>, RunError> {
    budget::read(path, &budget::CONFIG_FILE).map_err(RunError::io(path, "read"))
}

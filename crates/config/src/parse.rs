//! What a file says about an agent, and about the roles of a task: the behavior `Tag-v0` speaks of the run and of the first
//! role, `Tag-v0/opponent` of another.

use super::Loaded;
use super::error::ConfigError;
use super::section::Section;
use super::{convert, current, document, legacy, names};
use marathon_envs::shard::role_id;
use marathon_learn::RoleConfig;
use std::collections::BTreeMap;
use std::path::Path;

/// Reads what the bytes of a file say about an agent, which may go by any of its names; the path is for messages.
///
/// # Errors
/// If the file is no configuration, says nothing about the agent, or asks for what there is not. Messages name file, line and
/// key, what was found and what was expected.
pub fn parse(path: &Path, bytes: &[u8], agent: &str) -> Result<Loaded, ConfigError> {
    let map = document::parse(path, bytes)?;
    let agent = names::id(agent);
    let behavior = match map.keys().any(|key| current::TOP.contains(&key)) {
        true => current::read(path, &map, &agent)?,
        false => legacy::read(path, &map, &agent)?,
    };
    convert::convert(path, behavior)
}

/// Reads what the bytes of a file say about roles of a task but the first, by the roles' names. A role that the file does
/// not speak of has the settings of the first.
///
/// # Errors
/// If the file speaks of a role that there is not, or as for [`parse`].
pub fn parse_roles(
    path: &Path,
    bytes: &[u8],
    task: &str,
    roles: &[&str],
) -> Result<BTreeMap<String, RoleConfig>, ConfigError> {
    let map = document::parse(path, bytes)?;
    let root = Section::root(path, &map);
    let behaviors = if map.keys().any(|key| current::TOP.contains(&key)) { root.section("behaviors")? } else { root };
    let ids: Vec<String> = roles.iter().map(|role| role_id(task, role)).collect();
    let mut found = BTreeMap::new();
    for entry in behaviors.entries().filter(|entry| entry.key.starts_with(&role_id(task, ""))) {
        let Some(i) = ids.iter().position(|id| id == entry.key) else {
            let known: Vec<&str> = ids.iter().map(String::as_str).collect();
            return Err(ConfigError::unknown(entry.place, entry.key, &known));
        };
        found.insert(roles[i].to_string(), parse(path, bytes, &ids[i])?.config.into());
    }
    Ok(found)
}

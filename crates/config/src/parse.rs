//! What a file says about an agent, and about the roles of a task: the behavior `Tag-v0` speaks of the run and of the first
//! role, `Tag-v0/opponent` of another. Before the slash stands any name of the task.

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
    let keys: Vec<&str> = behaviors.entries().map(|entry| entry.key).collect();
    let mut found = BTreeMap::new();
    for role in roles {
        if let Some(key) = names::find_role(task, role, keys.iter().copied()) {
            found.insert(role.to_string(), parse(path, bytes, key)?.config.into());
        }
    }
    for entry in behaviors.entries() {
        let Some((name, role)) = entry.key.split_once('/') else { continue };
        let of_the_task = names::find(task, [name].into_iter()).is_some();
        if of_the_task && !roles.iter().any(|known| known.eq_ignore_ascii_case(role)) {
            let ids: Vec<String> = roles.iter().map(|role| role_id(name, role)).collect();
            let known: Vec<&str> = ids.iter().map(String::as_str).collect();
            return Err(ConfigError::unknown(entry.place, entry.key, &known));
        }
    }
    Ok(found)
}

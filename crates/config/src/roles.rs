//! Behaviors of a task's roles: `Tag-v0` speaks of the run and of the first role, `Tag-v0/opponent` of another.

use super::document;
use super::error::ConfigError;
use super::section::Section;
use super::{current, parse};
use marathon_learn::RoleConfig;
use std::collections::BTreeMap;
use std::path::Path;

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
    let ids: Vec<String> = roles.iter().map(|role| format!("{task}/{role}")).collect();
    let mut found = BTreeMap::new();
    for entry in behaviors.entries().filter(|entry| entry.key.starts_with(&format!("{task}/"))) {
        let Some(i) = ids.iter().position(|id| id == entry.key) else {
            let known: Vec<&str> = ids.iter().map(String::as_str).collect();
            return Err(ConfigError::unknown(entry.place, entry.key, &known));
        };
        found.insert(roles[i].to_string(), parse(path, bytes, &ids[i])?.config.into());
    }
    Ok(found)
}

//! Files of Unity's ML-Agents: today's schema, and the one of ML-Agents 0.x.

mod behavior;
mod convert;
mod current;
mod features;
mod legacy;
mod settings;

use super::document::{Map, Value};
use super::error::ConfigError;
use super::layer::File;
use super::loaded::Loaded;
use super::names;
use super::section::Section;
use std::path::Path;

/// Name of the section of an old file that serves all brains.
const DEFAULT: &str = "default";

/// Whether a file is one of ML-Agents, old or new.
pub fn is_from_there(map: &Map, task: &str) -> bool {
    is_current(map) || !File::has_keys(map) && is_legacy(map, task)
}

fn is_current(map: &Map) -> bool {
    map.keys().any(|key| current::TOP.contains(&key))
}

/// Whether a file has a section of an old brain: by its name, or by a key in it.
fn is_legacy(map: &Map, task: &str) -> bool {
    map.entries.iter().any(|field| {
        let is_brain = match &field.node.value {
            Value::Map(section) => section.keys().any(|key| legacy::BRAIN.contains(&key)),
            _ => false,
        };
        is_brain || field.key == DEFAULT || names::find(task, [field.key.as_str()].into_iter()).is_some()
    })
}

/// Reads what a file says about a task and its roles: the behavior with the task's name speaks of the run and of the first
/// role, `task/role` of another.
///
/// # Errors
/// If it says nothing about the task, or asks for what there is not.
pub fn read(path: &Path, map: &Map, task: &str) -> Result<Loaded, ConfigError> {
    let one = |name: &str| {
        let behavior = match is_current(map) {
            true => current::read(path, map, name)?,
            false => legacy::read(path, map, name)?,
        };
        convert::convert(path, behavior)
    };
    let mut loaded = one(task)?;
    let root = Section::root(path, map);
    let behaviors = if is_current(map) { root.section("behaviors")? } else { root };
    let keys: Vec<&str> = behaviors.entries().map(|entry| entry.key).collect();
    for (name, role) in keys.iter().filter_map(|key| key.split_once('/')) {
        let known = loaded.config.roles.keys().any(|known| known.eq_ignore_ascii_case(role));
        if known || names::find(task, [name].into_iter()).is_none() {
            continue;
        }
        if let Some(key) = names::find_role(task, role, keys.iter().copied()) {
            let role = key.split_once('/').map_or(role, |(_, role)| role);
            loaded.config.roles.insert(role.into(), one(key)?.config.into());
        }
    }
    Ok(loaded)
}

/// Whether a file has settings that serve all behaviors.
pub fn has_default(map: &Map) -> bool {
    map.keys().any(|key| key == if is_current(map) { "default_settings" } else { DEFAULT })
}

/// The behaviors of a file, without those of roles.
///
/// # Errors
/// If the file is none of ML-Agents.
pub fn behaviors(path: &Path, map: &Map) -> Result<Vec<String>, ConfigError> {
    if !is_from_there(map, "") {
        let problem = "found no behaviors, expected a file of ML-Agents: 'behaviors:', or sections of brains";
        return Err(ConfigError::syntax(path, 1, 1, problem));
    }
    let root = Section::root(path, map);
    let behaviors = if is_current(map) { root.section("behaviors")? } else { root };
    let names = behaviors.entries().map(|entry| entry.key.to_string());
    Ok(names.filter(|name| !name.contains('/') && (is_current(map) || name != DEFAULT)).collect())
}

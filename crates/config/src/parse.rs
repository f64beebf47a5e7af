//! From the bytes of a file to the settings of a task.

use super::document::{self, Map};
use super::error::{ConfigError, Place, shown};
use super::layer::{File, Layer, STAGES, TASK};
use super::loaded::{Loaded, to_yaml};
use super::mlagents;
use super::names;
use super::presets::default_for;
use marathon_physics::hint::did_you_mean;
use serde_json::{Map as Object, Value as Json};
use std::path::Path;

/// Reads the settings of a task from the bytes of a file. Any name of the task works; the path is for messages. In a
/// file of Marathon's, missing settings come from the task's preset, unless the file has `preset: false`. A file of
/// ML-Agents has ML-Agents' defaults.
///
/// # Errors
/// If the file is no configuration, has no settings for the task, or uses unsupported features. Messages name file, line
/// and key, the value found and the value expected.
pub fn parse(path: &Path, bytes: &[u8], task: &str) -> Result<Loaded, ConfigError> {
    read(path, &document::parse(path, bytes)?, task)
}

/// The same for JSON text that stands for an object of a program, which has no lines. `name` is what messages call it.
///
/// # Errors
/// As [`parse`].
pub fn parse_object(name: &str, json: &str, task: &str) -> Result<Loaded, ConfigError> {
    let path = Path::new(name);
    let mut map = document::parse(path, json.as_bytes())?;
    document::forget_lines(&mut map);
    read(path, &map, task)
}

fn read(path: &Path, map: &Map, task: &str) -> Result<Loaded, ConfigError> {
    let task = names::id(task);
    if mlagents::is_from_there(map, &task) {
        return mlagents::read(path, map, &task);
    }
    let file = File::read(path, map)?;
    if let Some(field) = map.get(STAGES).or(map.get(TASK)) {
        let place = Place { file: path.into(), line: field.line, key: field.key.clone() };
        let expected = format!("settings of one run; `marathon train {}` runs a file with stages", path.display());
        return Err(ConfigError::value(place, format!("'{}'", field.key), expected));
    }
    file.check_tasks(&task)?;
    let (layer, note) = file.of_task(&task);
    let base = if file.preset { default_for(&task) } else { Loaded::default() };
    let mut loaded = base.with(&layer, path)?;
    loaded.notes.extend(note);
    Ok(loaded)
}

/// Puts a setting over a configuration, `KEY=VALUE` with a value in YAML, such as `ppo.lr=3e-4`.
///
/// # Errors
/// If there is no such key, its value is of the wrong kind or does not go with the others, or it is one of another algorithm.
pub fn set(loaded: Loaded, text: &str) -> Result<Loaded, ConfigError> {
    let layer = Layer::set(text)?;
    let own = loaded.config.algorithm.name();
    match layer.algorithm().filter(|name| *name != own) {
        Some(other) => {
            let place = Place::of("--set", text.split('=').next().unwrap_or(other));
            Err(ConfigError::value(place, other, format!("{own}, the algorithm of this configuration")))
        }
        None => loaded.with(&layer, Path::new("--set")),
    }
}

/// A file of ML-Agents as one of Marathon's, in YAML, with notes on what differs there. A behavior becomes a task; tasks
/// of Marathon go by their own names.
///
/// # Errors
/// If the file is none of ML-Agents, or as for [`parse`].
pub fn convert(path: &Path, bytes: &[u8]) -> Result<(String, Vec<String>), ConfigError> {
    let map = document::parse(path, bytes)?;
    let behaviors = mlagents::behaviors(path, &map)?;
    if behaviors.is_empty() && !mlagents::has_default(&map) {
        let place = Place {
            file: path.into(),
            line: map.get("behaviors").map_or(1, |field| field.line),
            key: "behaviors".into(),
        };
        let expected = "a behavior with the name of a task, such as Hopper, or default_settings";
        return Err(ConfigError::value(place, "no behavior", expected));
    }
    let (mut tasks, mut notes) = (Object::new(), Vec::new());
    for behavior in &behaviors {
        let mut loaded = mlagents::read(path, &map, behavior)?;
        for note in std::mem::take(&mut loaded.notes) {
            if !notes.contains(&note) {
                notes.push(note);
            }
        }
        if let Err(near) = names::known(behavior) {
            notes.push(format!(
                "no task has the name '{}': rename it before you train with the result{}",
                shown(behavior),
                did_you_mean(near)
            ));
        }
        let name = names::task(behavior).filter(|name| !tasks.contains_key(*name)).unwrap_or(behavior);
        tasks.insert(name.into(), loaded.differences().into());
    }
    if mlagents::has_default(&map) && !behaviors.is_empty() {
        notes.push("what serves all behaviors is part of each task here; other tasks have Marathon's defaults".into());
    }
    let mut file = Object::from_iter([("preset".to_string(), Json::Bool(false))]);
    match behaviors.is_empty() {
        // the settings that serve all
        true => file.extend(mlagents::read(path, &map, "")?.differences()),
        false => _ = file.insert("tasks".into(), tasks.into()),
    }
    Ok((to_yaml(&file), notes))
}

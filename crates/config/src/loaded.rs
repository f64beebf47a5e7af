//! Result of loading a configuration: the settings of the trainer and of the run.

use super::error::ConfigError;
use super::layer::{Layer, OPTIONS, argument, overlay};
use super::{keys, yaml};
use marathon_envs::options::Value;
use marathon_learn::{Error, TrainConfig};
use serde_json::{Map as Object, Value as Json};
use std::path::Path;

/// Training settings of an agent from a configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// The trainer's configuration; it is valid.
    pub config: TrainConfig,
    /// Arguments of the task that differ from its defaults.
    pub options: Vec<(String, Value)>,
    /// Steps of a rollout of all agents, where a file of ML-Agents says that: with more agents, each makes fewer decisions.
    pub buffer: Option<u64>,
    /// Steps between summaries.
    pub summary_freq: u64,
    /// Steps between checkpoints.
    pub checkpoint_interval: u64,
    /// Policies on the way that are kept.
    pub keep_checkpoints: usize,
    /// Notes for the user: settings that have no effect here, or a different one than their name suggests.
    pub notes: Vec<String>,
}

impl Default for Loaded {
    /// The trainer's own defaults.
    fn default() -> Self {
        Loaded {
            config: TrainConfig::default(),
            options: Vec::new(),
            buffer: None,
            summary_freq: 50_000,
            checkpoint_interval: 500_000,
            keep_checkpoints: 5,
            notes: Vec::new(),
        }
    }
}

/// The settings that an algorithm starts from, by its name.
///
/// # Panics
/// If there is no such algorithm, which the command line rules out.
pub fn default_of(algorithm: &str) -> Loaded {
    let config = TrainConfig::of(algorithm).expect("the name of an algorithm");
    Loaded { config, ..Loaded::default() }
}

impl Loaded {
    /// The same with the settings of a layer over it. A layer for another algorithm lies over that algorithm's own settings.
    /// A role that the layer names starts from the settings of the first one, unless it has its own. The path is for messages.
    ///
    /// # Errors
    /// If the settings do not go together.
    pub fn with(mut self, layer: &Layer, path: &Path) -> Result<Self, ConfigError> {
        if let Some(algorithm) = layer.algorithm().filter(|name| *name != self.config.algorithm.name()) {
            self = default_of(algorithm);
        }
        let mut of_run = self.of_run();
        let mut config = object(&self.config);
        let mut old_roles = take(&mut config, "roles");
        let mut over = layer.values().clone();
        let (roles, options) = (take(&mut over, "roles"), take(&mut over, OPTIONS));
        for key in of_run.keys().cloned().collect::<Vec<_>>() {
            of_run.extend(over.remove(&key).map(|value| (key, value)));
        }
        // with more agents, each fills less of a buffer
        let agents = over.get("run").filter(|run| run["horizon"].is_null()).and_then(|run| run["agents"].as_u64());
        overlay(&mut config, &over);
        if let (Some(agents), Some(buffer)) = (agents, self.buffer) {
            config["run"]["horizon"] = buffer.div_ceil(agents).into();
        }
        let mut all = Object::new();
        for (name, over) in roles {
            let mut role = take(&mut old_roles, &name);
            if role.is_empty() {
                role = config.iter().filter(|(key, _)| *key != "run").map(|(k, v)| (k.clone(), v.clone())).collect();
            }
            let Json::Object(over) = over else { continue };
            choose(&mut role, &over);
            overlay(&mut role, &over);
            all.insert(name, role.into());
        }
        all.extend(old_roles);
        if !all.is_empty() {
            config.insert("roles".into(), all.into());
        }
        self.config = serde_json::from_value(config.into())
            .map_err(|error| ConfigError::syntax(path, 1, 1, format!("the settings do not fit together: {error}")))?;
        self.config.validate().map_err(|error| misfit(error, layer, path))?;
        let number = |key: &str| of_run[key].as_u64().unwrap_or_default();
        (self.summary_freq, self.checkpoint_interval) = (number("summary_freq"), number("checkpoint_interval"));
        self.keep_checkpoints = number("keep_checkpoints") as usize;
        for (name, value) in options {
            self.options.retain(|(known, _)| *known != name);
            self.options.push((name, argument(&value)));
        }
        Ok(self)
    }

    fn of_run(&self) -> Object<String, Json> {
        let Loaded { summary_freq, checkpoint_interval, keep_checkpoints, .. } = self;
        let pairs = [
            ("summary_freq", *summary_freq),
            ("checkpoint_interval", *checkpoint_interval),
            ("keep_checkpoints", *keep_checkpoints as u64),
        ];
        pairs.into_iter().map(|(key, n)| (key.to_string(), n.into())).collect()
    }

    /// The settings as a file has them, all of them.
    pub fn document(&self) -> Object<String, Json> {
        let mut all = object(&self.config);
        all.extend(self.of_run());
        let options = self.options.iter().map(|(name, value)| (name.clone(), written(value)));
        let options: Object<String, Json> = options.collect();
        if !options.is_empty() {
            all.insert(OPTIONS.into(), options.into());
        }
        all
    }

    /// The settings that differ from those that the algorithm starts from. The algorithm is named in any case.
    pub fn differences(&self) -> Object<String, Json> {
        let algorithm = self.config.algorithm.name();
        let mut all = differences(&self.document(), &default_of(algorithm).document());
        all.entry(algorithm).or_insert_with(|| Object::new().into());
        all
    }

    /// The settings that differ from those of another configuration.
    pub fn differences_from(&self, other: &Loaded) -> Object<String, Json> {
        differences(&self.document(), &other.document())
    }

    /// All settings as a file in YAML.
    pub fn to_yaml(&self) -> String {
        to_yaml(&self.document())
    }
}

/// Settings as a file in YAML.
pub fn to_yaml(document: &Object<String, Json>) -> String {
    yaml::document(document, &keys::rank)
}

/// An argument of a task as a file has it.
fn written(value: &Value) -> Json {
    match value {
        Value::Bool(x) => (*x).into(),
        Value::Number(x) if x.is_finite() => (*x).into(),
        Value::Text(text) => text.as_str().into(),
        // a file names its clips
        Value::Clips(clips) => clips.to_string().into(),
        Value::Number(_) | Value::Pair(_) => value.to_string().into(),
    }
}

/// A configuration as JSON.
fn object(config: &TrainConfig) -> Object<String, Json> {
    match serde_json::to_value(config) {
        Ok(Json::Object(map)) => map,
        _ => Object::new(),
    }
}

/// Takes a section out; it is empty if there is none.
fn take(map: &mut Object<String, Json>, key: &str) -> Object<String, Json> {
    match map.remove(key) {
        Some(Json::Object(section)) => section,
        _ => Object::new(),
    }
}

/// Gives a role the algorithm that a layer names, with the settings that it starts from.
fn choose(role: &mut Object<String, Json>, over: &Object<String, Json>) {
    let Some(name) = keys::ALGORITHMS.iter().find(|name| over.contains_key(**name)) else { return };
    if !role.contains_key(*name) {
        keys::ALGORITHMS.iter().for_each(|old| _ = role.remove(*old));
        let own = take(&mut default_of(name).document(), name);
        role.insert((*name).into(), own.into());
    }
}

/// Values that are in one document and not in the other, section by section.
fn differences(document: &Object<String, Json>, other: &Object<String, Json>) -> Object<String, Json> {
    let mut found = Object::new();
    for (key, value) in document {
        match (value, other.get(key)) {
            (value, Some(same)) if value == same => {}
            (Json::Object(section), Some(Json::Object(other))) => {
                // the ends of a schedule stay together
                let ends = section.contains_key("from");
                let inner = if ends { section.clone() } else { differences(section, other) };
                found.insert(key.clone(), inner.into());
            }
            _ => _ = found.insert(key.clone(), value.clone()),
        }
    }
    found
}

/// An error of settings that do not go together, at the place of the one that is at fault if the layer has set it.
fn misfit(error: Error, layer: &Layer, path: &Path) -> ConfigError {
    match error {
        Error::Config { field, found, expected } => match layer.place(&field) {
            Some(place) => ConfigError::value(place.clone(), found, expected),
            None => ConfigError::Combination { path: path.into(), source: Error::Config { field, found, expected } },
        },
        source => ConfigError::Combination { path: path.into(), source },
    }
}

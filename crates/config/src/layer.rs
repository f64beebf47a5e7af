//! Marathon's own files: the fields of the trainer's configuration, as many as the file names.

use super::document::{Field, Map, Node, Value as Yaml};
use super::error::{ConfigError, Place, shown};
use super::keys::{self, Kind, MOST_STEPS};
use super::section::{Entry, Range, Section};
use super::{document, names, stage_keys};
use marathon_envs::options::Value as Argument;
use marathon_physics::hint::{did_you_mean, nearest};
use serde_json::{Map as Object, Value, json};
use std::collections::BTreeMap;
use std::path::Path;

/// Sections and keys of a file that the trainer's configuration does not have.
pub const OPTIONS: &str = "options";
const ROLES: &str = "roles";
const TASKS: &str = "tasks";
const PRESET: &str = "preset";
pub const STAGES: &str = "stages";
pub const TASK: &str = "task";
/// Most levels of a key.
const MOST_LEVELS: usize = 8;
/// Section of ML-Agents' files, which a misspelled key may mean.
const BEHAVIORS: &str = "behaviors";

/// Some settings, with the places where they are set. It lies over others and hides them.
#[derive(Clone, Debug, Default)]
pub struct Layer {
    values: Object<String, Value>,
    places: BTreeMap<String, Place>,
}

/// Contents of a file: settings for all its tasks, and settings for single tasks.
#[derive(Clone, Debug)]
pub struct File {
    shared: Layer,
    tasks: Vec<OfTask>,
    /// Whether the preset of the task holds for what the file leaves out.
    pub preset: bool,
}

/// Settings for a single task.
#[derive(Clone, Debug)]
struct OfTask {
    name: String,
    place: Place,
    layer: Layer,
}

impl File {
    /// Whether a file has one of the keys of Marathon's own files.
    pub fn has_keys(map: &Map) -> bool {
        map.keys().any(|key| names(Part::File).contains(&key))
    }

    /// Reads a file.
    ///
    /// # Errors
    /// If it has a key that there is not, or a value of the wrong kind.
    pub fn read(path: &Path, map: &Map) -> Result<Self, ConfigError> {
        let root = Section::root(path, map);
        let shared = Layer::read(&root, Part::File)?;
        let mut tasks = Vec::new();
        let sections = root.section(TASKS)?;
        for entry in sections.entries() {
            let section = sections.section(entry.key)?;
            let layer = Layer::read(&section, Part::Task)?;
            tasks.push(OfTask { name: entry.key.to_string(), place: entry.place, layer });
        }
        let preset = root.flag(PRESET, true)?;
        Ok(File { shared, tasks, preset })
    }

    /// Whether the file has a section for a task of this name.
    pub fn has_task(&self, name: &str) -> bool {
        self.tasks.iter().any(|known| known.name.eq_ignore_ascii_case(name))
    }

    /// Refuses a section for a task that does not exist. `task`: the task that is asked for, which a front end may have made.
    ///
    /// # Errors
    /// Names the section and the nearest task.
    pub fn check_tasks(&self, task: &str) -> Result<(), ConfigError> {
        for OfTask { name, place, .. } in &self.tasks {
            if names::find(task, [name.as_str()].into_iter()).is_none()
                && let Err(near) = names::known(name)
            {
                let expected = format!("the name of a task; `marathon list` shows all{}", did_you_mean(near));
                let place = Place { key: shown(&place.key), ..place.clone() };
                return Err(ConfigError::value(place, format!("'{}'", shown(name)), expected));
            }
        }
        Ok(())
    }

    /// The file's settings for a task, and a note if the file has sections for other tasks only.
    pub fn of_task(&self, task: &str) -> (Layer, Option<String>) {
        let found = names::find(task, self.tasks.iter().map(|known| known.name.as_str()));
        let own = self.tasks.iter().find(|known| Some(known.name.as_str()) == found);
        // another name of the task
        match own.or_else(|| self.tasks.iter().find(|known| names::id(&known.name) == task)) {
            Some(own) => (self.shared.clone().under(&own.layer), None),
            None if self.tasks.is_empty() => (self.shared.clone(), None),
            None => {
                let note = format!("'tasks' has no section for {task}: the settings outside of 'tasks' apply");
                (self.shared.clone(), Some(note))
            }
        }
    }
}

/// Scope of a section.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    File,
    Task,
    Stage,
    Role,
}

/// Keys that are allowed at the top of a part.
fn names(part: Part) -> Vec<&'static str> {
    let mut names = keys::names_in("", part == Part::Role);
    names.extend(match part {
        Part::File => &[OPTIONS, ROLES, TASKS, PRESET, TASK, STAGES][..],
        Part::Task | Part::Stage => &[OPTIONS, ROLES],
        Part::Role => &[],
    });
    if part == Part::Stage {
        names.extend(stage_keys::of_kind("train"));
    }
    names
}

impl Layer {
    /// A setting as on a command line, `KEY=VALUE`; the value is YAML.
    ///
    /// # Errors
    /// If there is no such key, or its value is of the wrong kind.
    pub fn set(text: &str) -> Result<Self, ConfigError> {
        let path = Path::new("--set");
        let (key, value) = text.split_once('=').unwrap_or((text, ""));
        let place = Place::of("--set", &shown(key));
        if key.split('.').count() > MOST_LEVELS {
            return Err(ConfigError::unknown(place, key, &names(Part::Task)));
        }
        let mut entries = document::parse(path, format!("value: {value}").as_bytes())?.entries;
        let (Some(field), true) = (entries.pop(), entries.is_empty()) else {
            return Err(ConfigError::value(place, format!("'{}'", shown(value)), "one value"));
        };
        let mut map = Map { entries: vec![field] };
        for (i, name) in key.trim().split('.').rev().enumerate() {
            if i > 0 {
                let node = Node { line: 0, value: Yaml::Map(map) };
                map = Map { entries: vec![Field { key: String::new(), line: 0, node }] };
            }
            map.entries[0].key = name.into();
        }
        document::forget_lines(&mut map);
        Self::read(&Section::root(path, &map), Part::Task)
    }

    /// The settings of a stage that trains.
    ///
    /// # Errors
    /// As [`File::read`].
    pub fn of_stage(section: &Section<'_>) -> Result<Self, ConfigError> {
        Self::read(section, Part::Stage)
    }

    fn read(section: &Section<'_>, part: Part) -> Result<Self, ConfigError> {
        let mut layer = Layer::default();
        layer.values = layer.section(section, "", part)?;
        match layer.algorithms()[..] {
            [] | [_] => Ok(layer),
            [first, second, ..] => {
                let place = layer.place(second).cloned();
                let expected = format!("settings of one algorithm, {first} or {second}");
                let place = place.unwrap_or_else(|| Place::of("configuration", second));
                Err(ConfigError::value(place, "another algorithm", expected))
            }
        }
    }

    /// The settings of a section whose path in the reference is `path`.
    fn section(&mut self, section: &Section<'_>, path: &str, part: Part) -> Result<Object<String, Value>, ConfigError> {
        let mut values = Object::new();
        let known = if path.is_empty() { names(part) } else { keys::names_in(path, part == Part::Role) };
        for entry in section.entries() {
            let inner = if path.is_empty() { entry.key.into() } else { format!("{path}.{}", entry.key) };
            if !known.contains(&entry.key) {
                return Err(unknown(entry, &known, path, part));
            }
            let value = match entry.key {
                TASKS | PRESET | STAGES | TASK if path.is_empty() => continue,
                key if path.is_empty() && part == Part::Stage && stage_keys::find(key).is_some() => continue,
                OPTIONS if path.is_empty() => options(&section.section(OPTIONS)?)?,
                ROLES if path.is_empty() => self.roles(&section.section(ROLES)?)?,
                _ => match keys::find(&inner) {
                    Some(key) => value(section, &entry, key.kind)?,
                    None if entry.node.is_null() && keys::REWARDS[1..].contains(&inner.as_str()) => Value::Null,
                    None if entry.node.is_null() && inner == keys::REWARDS[0] => {
                        let expected = "a mapping such as {gamma: 0.99}: no run is without the task's own reward";
                        return Err(ConfigError::value(entry.place, "nothing", expected));
                    }
                    None => Value::Object(self.section(&section.section(entry.key)?, &inner, part)?),
                },
            };
            values.insert(entry.key.into(), value);
            self.places.insert(inner, entry.place);
        }
        Ok(values)
    }

    fn roles(&mut self, roles: &Section<'_>) -> Result<Value, ConfigError> {
        let mut all = Object::new();
        for entry in roles.entries() {
            let role = Layer::read(&roles.section(entry.key)?, Part::Role)?;
            let key = format!("{ROLES}.{}", entry.key);
            self.places.extend(role.places.into_iter().map(|(inner, place)| (format!("{key}.{inner}"), place)));
            self.places.insert(key, entry.place);
            all.insert(entry.key.into(), Value::Object(role.values));
        }
        Ok(Value::Object(all))
    }

    /// The settings, by sections.
    pub fn values(&self) -> &Object<String, Value> {
        &self.values
    }

    /// The place of a setting, or of the section that it would be in.
    pub fn place(&self, key: &str) -> Option<&Place> {
        let mut key = key;
        loop {
            match (self.places.get(key), key.rsplit_once('.')) {
                (Some(place), _) => return Some(place),
                (None, Some((section, _))) => key = section,
                (None, None) => return None,
            }
        }
    }

    /// The algorithm that it names.
    pub fn algorithm(&self) -> Option<&'static str> {
        self.algorithms().first().copied()
    }

    fn algorithms(&self) -> Vec<&'static str> {
        keys::ALGORITHMS.iter().filter(|name| self.values.contains_key(**name)).copied().collect()
    }

    /// This layer under another.
    #[must_use]
    pub fn under(mut self, other: &Layer) -> Self {
        if let (Some(old), Some(new)) = (self.algorithm(), other.algorithm())
            && old != new
        {
            self.values.remove(old);
        }
        overlay(&mut self.values, &other.values);
        self.places.extend(other.places.iter().map(|(key, place)| (key.clone(), place.clone())));
        self
    }
}

/// Puts settings over others: sections key by key, all else as a whole.
pub fn overlay(base: &mut Object<String, Value>, over: &Object<String, Value>) {
    for (key, value) in over {
        match (base.get_mut(key), value) {
            (Some(Value::Object(base)), Value::Object(over)) => overlay(base, over),
            // a schedule that stays, of which an end is set
            (Some(base @ Value::Number(_)), Value::Object(over)) => {
                let mut ends = Object::from_iter([("from".into(), base.clone()), ("to".into(), base.clone())]);
                overlay(&mut ends, over);
                *base = Value::Object(ends);
            }
            (_, value) => {
                base.insert(key.clone(), value.clone());
            }
        }
    }
}

/// A key that there is not; a name that another section has is found there.
fn unknown(entry: Entry<'_>, known: &[&str], path: &str, part: Part) -> ConfigError {
    let Entry { mut place, key, .. } = entry;
    place.key = shown(&place.key);
    let of_file = path.is_empty() && part == Part::File;
    let known: Vec<&str> = known.iter().copied().chain(of_file.then_some(BEHAVIORS)).collect();
    match keys::elsewhere(key).filter(|_| nearest(key, known.iter().copied()).is_none()) {
        Some(elsewhere) => ConfigError::UnknownKey { place, nearest: Some(elsewhere), known: known.join(", ") },
        None => ConfigError::unknown(place, key, &known),
    }
}

/// Arguments of the task. Whether it takes them, the task knows.
fn options(section: &Section<'_>) -> Result<Value, ConfigError> {
    let expected = "a number, a word, true or false, or a range such as [0.8, 2]";
    let read = |entry: Entry<'_>| {
        let text = match &entry.node.value {
            Yaml::List(ends) if ends.len() == 2 => {
                let ends = entry.items(expected)?;
                format!("({}, {})", ends[0].number(Range::Finite)?, ends[1].number(Range::Finite)?)
            }
            _ => entry.word_of_any_kind(expected)?,
        };
        Ok((entry.key.to_string(), Value::String(text)))
    };
    section.entries().map(read).collect::<Result<_, _>>().map(Value::Object)
}

/// The options of a section, as the task takes them.
///
/// # Errors
/// If a value cannot be an option.
pub fn options_of(section: &Section<'_>) -> Result<Vec<(String, Argument)>, ConfigError> {
    let Value::Object(found) = options(&section.section(OPTIONS)?)? else { return Ok(Vec::new()) };
    Ok(found.iter().map(|(name, value)| (name.clone(), argument(value))).collect())
}

/// An option of a task in a layer.
pub fn argument(value: &Value) -> Argument {
    value.as_str().unwrap_or_default().parse().unwrap_or_else(|never| match never {})
}

/// The value of a key of a stage.
///
/// # Errors
/// If it is of the wrong kind.
pub fn stage_value(section: &Section<'_>, entry: &Entry<'_>) -> Result<Value, ConfigError> {
    stage_keys::find(entry.key).map_or(Ok(Value::Null), |key| value(section, entry, key.kind))
}

/// A value of a kind.
fn value(section: &Section<'_>, entry: &Entry<'_>, kind: Kind) -> Result<Value, ConfigError> {
    // what the kind expects, not what the part of it that is wrong does
    let whole = |error: ConfigError| match error {
        ConfigError::Value { place, found, .. } => ConfigError::value(place, found, kind.text()),
        error => error,
    };
    let number = |range: Range| entry.number(range).map(Value::from);
    match kind {
        Kind::Count(_, most) if entry.is_above(most) => entry.wrong(format!("a whole number up to {most}")),
        Kind::Count(least, most) => entry.count(least..=most).map(Value::from).map_err(whole),
        Kind::Steps(least) if entry.steps().is_some_and(|n| n > MOST_STEPS) || entry.is_above(MOST_STEPS) => {
            entry.wrong(format!("a whole number from {least} to {MOST_STEPS}"))
        }
        Kind::Steps(least) => match entry.steps().filter(|n| *n >= least) {
            Some(n) => Ok(n.into()),
            None => entry.wrong(kind.text()),
        },
        Kind::Number(range) => number(range),
        Kind::Flag => entry.flag().map(Value::from),
        Kind::Word(words) => entry.word(words).map(|i| words[i].into()),
        Kind::Text => entry.word_of_any_kind("a text").map(Value::from),
        Kind::Optional(_) if entry.node.is_null() => Ok(Value::Null),
        Kind::Optional(kind) => value(section, entry, *kind),
        Kind::Widths => {
            let items = entry.items(&kind.text())?;
            items.iter().map(|item| item.count(1..=65_536).map(Value::from)).collect()
        }
        Kind::Words => {
            let items = entry.items(&kind.text())?;
            items.iter().map(|item| item.word_of_any_kind("a name").map(Value::from)).collect()
        }
        Kind::Pair => {
            let items = entry.items(&kind.text())?;
            let numbers: Vec<f64> = items.iter().map(|item| item.number(Range::Positive)).collect::<Result<_, _>>()?;
            match numbers[..] {
                [low, high] if low <= high => Ok(json!([low, high])),
                _ => Err(ConfigError::value(entry.place.clone(), format!("{numbers:?}"), kind.text())),
            }
        }
        Kind::Schedule(range) => match entry.node.value {
            Yaml::Map(_) => {
                let ends = section.section(entry.key)?;
                ends.only(&["from", "to"])?;
                let end = |entry: Entry<'_>| Ok((entry.key.to_string(), entry.number(range)?.into()));
                ends.entries().map(end).collect::<Result<_, _>>().map(Value::Object)
            }
            _ => number(range).map_err(whole),
        },
    }
}

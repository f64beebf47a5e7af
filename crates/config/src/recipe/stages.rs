//! Stages as a file has them.
//!
//! A stage has the keys of a configuration and those of `stage_keys`. Its settings lie over those at the top of the file, which
//! lie over the stage's `config` or the task's preset.

use super::criterion::{Criterion, Pick};
use super::sources::Source;
use crate::document;
use crate::error::{ConfigError, Place, shown};
use crate::keys::MOST_STEPS;
use crate::layer::{self, File, Layer, STAGES, TASK};
use crate::loaded::{Loaded, default_of};
use crate::names;
use crate::parse::parse;
use crate::presets::default_for;
use crate::section::{Entry, Section};
use crate::stage_keys as keys;
use marathon_envs::options::Value;
use marathon_physics::hint::did_you_mean;
use std::path::{Path, PathBuf};

/// Most stages: their folders have numbers of two digits.
const MOST_STAGES: usize = 99;
/// Longest name of a stage.
const LONGEST_NAME: usize = 64;
/// Episodes of a measurement, unless the stage says otherwise.
const EPISODES: u64 = 100;

/// A file with stages.
#[derive(Clone, Debug)]
pub struct Recipe {
    /// The file.
    pub path: PathBuf,
    /// Its bytes.
    pub text: Vec<u8>,
    /// The task of the last stage, and of stages that name none.
    pub task: String,
    /// The stages, in their order.
    pub stages: Vec<Stage>,
    file: File,
}

/// A stage.
#[derive(Clone, Debug)]
pub struct Stage {
    /// Its name.
    pub name: String,
    /// The place of its name.
    pub place: Place,
    /// Its task.
    pub task: String,
    /// How it makes its policy.
    pub kind: StageKind,
    /// Agent-steps, unless the settings say them.
    pub steps: Option<u64>,
    /// Seeds: one run for each. Empty: the seed of the settings.
    pub seeds: Vec<u64>,
    /// Measure that chooses a seed.
    pub pick: Option<Pick>,
    /// Measure that ends the stage before its last step.
    pub until: Option<Criterion>,
    /// Whether the recipe fails if `until` is not reached.
    pub or_fail: bool,
    /// Episodes of measurements.
    pub episodes: u64,
    /// Options of the task. Those of a stage that trains are among its settings.
    pub options: Vec<(String, Value)>,
    settings: Layer,
}

/// How a stage makes its policy.
#[derive(Clone, Debug, PartialEq)]
pub enum StageKind {
    /// Reinforcement learning.
    Train {
        /// Configuration file in place of the preset.
        config: Option<String>,
        /// Policy that it starts from.
        initialize_from: Option<Source>,
    },
    /// Distillation.
    Distill {
        /// Policies to learn from.
        teachers: Vec<Source>,
        /// Policy that it starts from.
        initialize_from: Option<Source>,
        /// Widths of the hidden layers.
        hidden: Option<Vec<usize>>,
        /// Agents of each teacher.
        agents: Option<usize>,
        /// Learning rate at the start.
        lr: Option<f64>,
    },
    /// The mean of policies.
    Average {
        /// The policies.
        policies: Vec<Source>,
    },
}

impl StageKind {
    /// Its name: that of the command that does the same.
    pub fn name(&self) -> &'static str {
        match self {
            StageKind::Train { .. } => "train",
            StageKind::Distill { .. } => "distill",
            StageKind::Average { .. } => "average",
        }
    }

    /// The policies that it uses.
    pub fn sources(&self) -> Vec<&Source> {
        match self {
            StageKind::Train { initialize_from, .. } => initialize_from.iter().collect(),
            StageKind::Distill { teachers, initialize_from, .. } => teachers.iter().chain(initialize_from).collect(),
            StageKind::Average { policies } => policies.iter().collect(),
        }
    }
}

impl Recipe {
    /// Reads a file with stages. Its task may go by any name; the path is for messages.
    ///
    /// # Errors
    /// If the file has no stages, or a key or value that is not allowed. Messages name file, line and key, what was found and
    /// what was expected.
    pub fn parse(path: &Path, bytes: &[u8]) -> Result<Self, ConfigError> {
        Self::of(path, bytes, &document::parse(path, bytes)?)
    }

    /// The same for a text of the program itself, which has no limit.
    ///
    /// # Errors
    /// As [`Recipe::parse`].
    pub(super) fn parse_text(path: &Path, text: &str) -> Result<Self, ConfigError> {
        Self::of(path, text.as_bytes(), &document::parse_text(path, text)?)
    }

    fn of(path: &Path, bytes: &[u8], map: &document::Map) -> Result<Self, ConfigError> {
        let root = Section::root(path, map);
        let Some(entry) = root.set(STAGES) else {
            let problem = format!(
                "found no '{STAGES}', expected a file with stages; `marathon train TASK --config {}` reads a configuration",
                path.display()
            );
            return Err(ConfigError::syntax(path, 1, 1, problem));
        };
        let Some(task) = root.set(TASK) else {
            return Err(ConfigError::value(Place { key: TASK.into(), ..entry.place }, "nothing", "the name of a task"));
        };
        let task = known_task(&task)?;
        let file = File::read(path, map)?;
        file.check_tasks(&task)?;
        let section = root.section(STAGES)?;
        let mut stages = Vec::new();
        for entry in section.entries() {
            let stage = Stage::read(&section, entry, &task, &stages)?;
            stages.push(stage);
        }
        match stages.last() {
            None => Err(ConfigError::value(entry.place, "no stage", "one or more")),
            Some(_) if stages.len() > MOST_STAGES => Err(ConfigError::value(
                entry.place,
                format!("{} stages", stages.len()),
                format!("at most {MOST_STAGES}"),
            )),
            Some(_) => Ok(Recipe { path: path.into(), text: bytes.into(), task, stages, file }),
        }
    }

    /// Whether stages begin with the presets of their tasks.
    pub fn has_preset(&self) -> bool {
        self.file.preset
    }

    /// The settings that a stage that trains begins with: those of its configuration file, given by name and bytes, or of the
    /// task's preset.
    ///
    /// # Errors
    /// If the file is no configuration for the task.
    pub fn base(&self, stage: &Stage, config: Option<(&Path, &[u8])>) -> Result<Loaded, ConfigError> {
        match config {
            Some((path, bytes)) => parse(path, bytes, &stage.task),
            None if self.file.preset => Ok(default_for(&stage.task)),
            None => Ok(default_of("ppo")),
        }
    }

    /// The settings of a stage that trains, over those that it begins with.
    ///
    /// # Errors
    /// If they do not go together.
    pub fn settings(&self, stage: &Stage, base: Loaded) -> Result<Loaded, ConfigError> {
        let (shared, _) = self.file.of_task(&stage.task);
        let mut loaded = base.with(&shared, &self.path)?.with(&stage.settings, &self.path)?;
        let run = &mut loaded.config.run;
        run.total_steps = stage.steps.unwrap_or(run.total_steps);
        Ok(loaded)
    }
}

impl Stage {
    fn read(stages: &Section<'_>, entry: Entry<'_>, task: &str, earlier: &[Stage]) -> Result<Self, ConfigError> {
        let name = entry.key;
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || name.len() > LONGEST_NAME || !name.chars().all(is_plain) {
            let place = Place { key: shown(&entry.place.key), ..entry.place };
            let expected = format!("a name of letters, digits, '_' and '-', {LONGEST_NAME} at most");
            return Err(ConfigError::value(place, format!("'{}'", shown(name)), expected));
        }
        let own = stages.section(name)?;
        let of_kind = match (own.get("distill"), own.get("average")) {
            (Some(_), Some(entry)) => {
                return Err(ConfigError::value(
                    entry.place,
                    "a second kind",
                    "distill or average in a stage, not both",
                ));
            }
            (Some(_), None) => "distill",
            (None, Some(_)) => "average",
            (None, None) => "train",
        };
        let mut stage = Stage {
            name: name.into(),
            place: entry.place,
            task: own.set(TASK).map_or(Ok(task.to_string()), |entry| known_task(&entry))?,
            kind: StageKind::Average { policies: Vec::new() },
            steps: None,
            seeds: Vec::new(),
            pick: None,
            until: None,
            or_fail: own.flag("or_fail", false)?,
            episodes: EPISODES,
            options: Vec::new(),
            settings: Layer::default(),
        };
        if of_kind == "train" {
            stage.settings = Layer::of_stage(&own)?;
        } else {
            let known = [&keys::of_kind(of_kind)[..], &[layer::OPTIONS]].concat();
            own.only(&known)?;
            stage.options = layer::options_of(&own)?;
        }
        let value = |key: &str| own.set(key).map(|entry| layer::stage_value(&own, &entry)).transpose();
        let number = |key: &str| Ok::<_, ConfigError>(value(key)?.and_then(|value| value.as_u64()));
        stage.steps = number("steps")?;
        stage.episodes = number("episodes")?.unwrap_or(EPISODES);
        stage.read_seeds(&own, number("seed")?)?;
        stage.until = own.set("until").map(|entry| worded(&entry, Criterion::read, Criterion::EXPECTED)).transpose()?;
        if let (Some(entry), None) = (own.set("or_fail"), &stage.until) {
            return Err(ConfigError::value(entry.place, "no 'until'", "'until' beside it"));
        }
        let known: Vec<&str> = earlier.iter().map(|stage| stage.name.as_str()).collect();
        let source = |key: &str| own.set(key).map(|entry| Source::read(&entry, &known, false)).transpose();
        let sources = |key: &str, kept: bool| {
            let Some(entry) = own.get(key) else { return Ok(Vec::new()) };
            let items = listed(&entry, "stages or files")?;
            items.iter().map(|item| Source::read(item, &known, kept)).collect()
        };
        stage.kind = match of_kind {
            "average" => StageKind::Average { policies: sources("average", true)? },
            "distill" => StageKind::Distill {
                teachers: sources("distill", false)?,
                initialize_from: source("initialize_from")?,
                hidden: value("hidden")?.and_then(|value| {
                    Some(value.as_array()?.iter().filter_map(|n| Some(n.as_u64()? as usize)).collect())
                }),
                agents: number("agents")?.map(|n| n as usize),
                lr: value("lr")?.and_then(|value| value.as_f64()),
            },
            _ => StageKind::Train {
                config: value("config")?.and_then(|value| value.as_str().map(String::from)),
                initialize_from: source("initialize_from")?,
            },
        };
        stage.check_average(&own, earlier)?;
        Ok(stage)
    }

    fn read_seeds(&mut self, own: &Section<'_>, seed: Option<u64>) -> Result<(), ConfigError> {
        self.seeds.extend(seed);
        if let Some(entry) = own.set("seeds") {
            if seed.is_some() {
                return Err(ConfigError::value(entry.place, "'seed' and 'seeds'", "one of them"));
            }
            for item in listed(&entry, "whole numbers such as [1, 2, 3]")? {
                let seed = item.count(0..=MOST_STEPS)?;
                if self.seeds.contains(&seed) {
                    return Err(ConfigError::value(item.place, format!("{seed} twice"), "each seed once"));
                }
                self.seeds.push(seed);
            }
        }
        self.pick = own.set("pick").map(|entry| worded(&entry, Pick::read, Pick::EXPECTED)).transpose()?;
        match (own.set("pick"), self.seeds.len() > 1) {
            (Some(entry), false) => Err(ConfigError::value(entry.place, "no 'seeds'", "two or more 'seeds' beside it")),
            (None, true) => {
                let place = Place { key: format!("{}.pick", self.place.key), ..self.place.clone() };
                Err(ConfigError::value(place, "nothing", Pick::EXPECTED))
            }
            _ => Ok(()),
        }
    }

    /// Refuses an average of one policy. Takes the task of what is averaged.
    fn check_average(&mut self, own: &Section<'_>, earlier: &[Stage]) -> Result<(), ConfigError> {
        let (StageKind::Average { policies }, Some(entry)) = (&self.kind, own.get("average")) else { return Ok(()) };
        let of_stage = policies.iter().rev().find_map(|source| source.stage());
        if let Some(i) = of_stage {
            self.task.clone_from(&earlier[i].task);
        }
        if let [Source::Stage(i)] = &policies[..] {
            let expected =
                format!("two or more, or {}/policies, which means all that the stage has kept", earlier[*i].name);
            return Err(ConfigError::value(entry.place, "one policy", expected));
        }
        if policies.len() == 1 && of_stage.is_none() {
            return Err(ConfigError::value(entry.place, "one policy", "two or more"));
        }
        let kept = policies.iter().find_map(|source| match source {
            Source::Kept(i) if !matches!(earlier[*i].kind, StageKind::Train { .. }) => Some(&earlier[*i]),
            _ => None,
        });
        match kept {
            Some(stage) => {
                let found = format!("the policies of {}, a stage that does not train", stage.name);
                Err(ConfigError::value(entry.place, found, "those of a stage that trains"))
            }
            None => Ok(()),
        }
    }
}

/// The task that an entry names.
fn known_task(entry: &Entry<'_>) -> Result<String, ConfigError> {
    let name = entry.word_of_any_kind("the name of a task")?;
    match names::known(&name) {
        Ok(()) => Ok(names::id(&name)),
        Err(near) => {
            let expected = format!("the name of a task; `marathon list` shows all{}", did_you_mean(near));
            Err(ConfigError::value(entry.place.clone(), format!("'{}'", shown(&name)), expected))
        }
    }
}

/// A text with a form of its own.
fn worded<T>(entry: &Entry<'_>, read: impl Fn(&str) -> Option<T>, expected: &str) -> Result<T, ConfigError> {
    let text = entry.word_of_any_kind(expected)?;
    read(&text).map_or_else(|| entry.wrong(expected), Ok)
}

/// The entries of a list of bounded length.
fn listed<'a>(entry: &Entry<'a>, what: &str) -> Result<Vec<Entry<'a>>, ConfigError> {
    let expected = format!("a list of {what}");
    let items = entry.items(&expected)?;
    match items.len() {
        0 => Err(ConfigError::value(entry.place.clone(), "an empty list", expected)),
        n if n > keys::MOST_LISTED => {
            let found = format!("{n} entries");
            Err(ConfigError::value(entry.place.clone(), found, format!("at most {}", keys::MOST_LISTED)))
        }
        _ => Ok(items),
    }
}

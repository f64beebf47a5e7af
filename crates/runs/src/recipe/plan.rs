//! The stages of a recipe with their settings. All are checked before the first one begins.

use super::state::{self, Done, StageFile};
use crate::configuration::check_options;
use crate::distill::DistillOptions;
use crate::error::RunError;
use crate::folder::policy_path;
use crate::inputs;
use crate::measure;
use crate::task_config::{TaskConfig, TaskOptions};
use crate::text::{path_word, word};
use marathon_config::recipe::{Recipe, Source, Stage, StageKind};
use marathon_config::{Loaded, default_for, default_of, shipped};
use marathon_envs::options::Value as Argument;
use marathon_envs::registry;
use marathon_learn::checksum;
use marathon_physics::budget;
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// A recipe in a folder.
pub struct Plan {
    /// The recipe.
    pub recipe: Recipe,
    /// Its folder.
    pub folder: PathBuf,
    /// Its stages, in their order.
    pub steps: Vec<Step>,
}

/// A stage with its settings.
pub struct Step {
    /// Its folder.
    pub folder: PathBuf,
    /// Its task.
    pub task: TaskConfig,
    /// Seeds of its runs. Empty for an average.
    pub seeds: Vec<u64>,
    /// Its work.
    pub job: Job,
}

/// Work of a stage.
pub enum Job {
    /// Reinforcement learning, with the settings of the run.
    Train(Box<Loaded>),
    /// Distillation.
    Distill(DistillOptions),
    /// The mean of policies.
    Average,
}

impl Plan {
    /// Checks the stages of a recipe. `seed` replaces 1: the seed of every stage moves by the difference.
    ///
    /// # Errors
    /// If a stage has settings, options or measures that its task does not have, or names a file that does not exist.
    pub fn new(recipe: Recipe, folder: &Path, seed: u64, threads: Option<usize>) -> Result<Self, RunError> {
        let steps = recipe.stages.iter().enumerate().map(|(i, stage)| {
            let folder = state::folder(folder, i, &stage.name);
            step(&recipe, stage, folder, seed, threads)
        });
        let steps = steps.collect::<Result<_, _>>()?;
        Ok(Plan { folder: folder.into(), steps, recipe })
    }

    /// The stage of an index with its settings.
    pub fn stage(&self, i: usize) -> (&Stage, &Step) {
        (&self.recipe.stages[i], &self.steps[i])
    }

    /// The policy that a stage uses: a file, or the folder of the run that has kept it.
    pub fn policy(&self, source: &Source, done: &[Option<Done>]) -> PathBuf {
        match source {
            Source::Stage(i) => self.steps[*i].folder.join(state::POLICY),
            Source::Kept(i) => self.run_folder(*i, done[*i].as_ref().and_then(|done| done.seed)),
            Source::File(name) => beside(&self.recipe, name),
        }
    }

    /// The folder of a stage's run.
    pub fn run_folder(&self, i: usize, seed: Option<u64>) -> PathBuf {
        let Step { folder, seeds, .. } = &self.steps[i];
        match seed {
            Some(seed) if seeds.len() > 1 => folder.join(format!("seed-{seed}")),
            _ => folder.clone(),
        }
    }

    /// The name of a policy that a stage uses, as the recipe has it.
    pub fn name_of(&self, source: &Source) -> String {
        match source {
            Source::Stage(i) => self.recipe.stages[*i].name.clone(),
            Source::Kept(i) => format!("{}/policies", self.recipe.stages[*i].name),
            Source::File(name) => name.clone(),
        }
    }

    /// Everything that a stage is made from. `None` if a stage that it uses is not done.
    ///
    /// # Errors
    /// If a file that it uses cannot be read.
    pub fn describe(&self, i: usize, done: &[Option<Done>]) -> Result<Option<StageFile>, RunError> {
        let (stage, step) = self.stage(i);
        let mut files = Map::new();
        for source in stage.kind.sources() {
            let sum = match source {
                Source::Stage(i) => match done.get(*i) {
                    Some(Some(done)) => done.policy.clone(),
                    _ => return Ok(None),
                },
                Source::Kept(i) if done.get(*i).is_none_or(Option::is_none) => return Ok(None),
                Source::Kept(_) => {
                    let kept = crate::report::kept_policies(&self.policy(source, done));
                    let sums = kept.iter().map(|(_, path)| state::sum(path)).collect::<Result<Vec<_>, _>>()?;
                    checksum(sums.join(" ").as_bytes())
                }
                Source::File(_) => state::sum(&policy_path(&self.policy(source, done))?)?,
            };
            files.insert(self.name_of(source), sum.into());
        }
        for (name, clip) in step.task.options.given_clips() {
            files.insert(format!("clip {name}"), checksum(&clip.to_bytes()).into());
        }
        let names = |sources: &[Source]| sources.iter().map(|source| self.name_of(source)).collect::<Vec<_>>();
        let start = |source: &Option<Source>| source.as_ref().map(|source| self.name_of(source));
        let mut about = json!({ "kind": stage.kind.name(), "task": step.task.agent, "seeds": step.seeds });
        match (&stage.kind, &step.job) {
            (StageKind::Train { initialize_from, .. }, Job::Train(loaded)) => {
                let mut loaded = (**loaded).clone();
                inputs::name_wholly(&mut loaded.config);
                for (path, sum) in inputs::of(&step.task, &loaded.config)? {
                    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                    files.insert(format!("file {name}"), sum.into());
                }
                let mut settings = loaded.document();
                // these change no result, and the seeds stand beside
                settings.remove("summary_freq");
                if let Some(run) = settings.get_mut("run").and_then(Value::as_object_mut) {
                    run.remove("threads");
                    run.remove("seed");
                }
                about["settings"] = settings.into();
                about["initialize_from"] = json!(start(initialize_from));
            }
            (StageKind::Distill { teachers, initialize_from, .. }, Job::Distill(options)) => {
                let DistillOptions { hidden, steps, agents, lr, .. } = options;
                about["settings"] = json!({ "hidden": hidden, "steps": steps, "agents": agents, "lr": lr });
                about["distill"] = json!(names(teachers));
                about["initialize_from"] = json!(start(initialize_from));
            }
            (StageKind::Average { policies }, _) => about["average"] = json!(names(policies)),
            _ => {}
        }
        if !matches!(step.job, Job::Train(_)) {
            let options = stage.options.iter().map(|(name, value)| (name.clone(), value.to_string().into()));
            about["options"] = Value::Object(options.collect());
        }
        if let Some(pick) = &stage.pick {
            about["pick"] = pick.to_string().into();
        }
        if let Some(until) = &stage.until {
            about["until"] = until.to_string().into();
            about["or_fail"] = stage.or_fail.into();
        }
        if stage.pick.is_some() || stage.until.is_some() {
            about["episodes"] = stage.episodes.into();
        }
        about["files"] = files.into();
        Ok(Some(StageFile::new(about)))
    }

    /// The stages that a stage is made from, itself included.
    pub fn ancestors(&self, i: usize) -> Vec<usize> {
        let mut used = vec![false; self.steps.len()];
        used[i] = true;
        // a stage only uses earlier ones
        for i in (0..=i).rev().filter(|i| *i < self.steps.len()) {
            if used[i] {
                let sources = self.recipe.stages[i].kind.sources();
                sources.iter().filter_map(|source| source.stage()).for_each(|i| used[i] = true);
            }
        }
        (0..used.len()).filter(|i| used[*i]).collect()
    }

    /// The commands without a recipe that do the same as a stage, one for each seed.
    pub fn commands(&self, i: usize, done: &[Option<Done>]) -> Vec<String> {
        let (stage, step) = self.stage(i);
        let path = |source: &Source| path_word(&self.policy(source, done));
        let start = |source: &Option<Source>| {
            source.iter().map(|s| format!(" --initialize-from {}", path(s))).collect::<String>()
        };
        let options = |options: &mut dyn Iterator<Item = (&String, String)>| {
            options.map(|(name, value)| format!(" --option {}", word(&format!("{name}={value}")))).collect::<String>()
        };
        let plain = |value: &Argument| match value {
            Argument::Text(text) => text.clone(),
            value => value.to_string(),
        };
        let given = options(&mut stage.options.iter().map(|(name, value)| (name, plain(value))));
        let out = path_word(&step.folder.join(state::POLICY));
        match (&stage.kind, &step.job) {
            (StageKind::Train { initialize_from, .. }, Job::Train(loaded)) => {
                // a configuration may be one that is no file, so its settings are named
                let (preset, name) = (default_for(&stage.task), loaded.config.algorithm.name());
                let has_preset = self.recipe.has_preset() && preset.config.algorithm.name() == name;
                let (base, algorithm) = match has_preset {
                    true => (preset, String::new()),
                    false => (default_of(name), format!(" --algo {name}")),
                };
                let mut own = loaded.differences_from(&base);
                let of_task = own.remove("options").unwrap_or_default();
                let of_task = of_task.as_object().cloned().unwrap_or_default();
                let text = |value: &Value| value.as_str().map_or_else(|| value.to_string(), String::from);
                let given = options(&mut of_task.iter().map(|(name, value)| (name, text(value))));
                let mut settings = String::new();
                flatten("", &own, &mut |key, value| match key {
                    "run.seed" | "run.threads" => {}
                    _ => settings += &format!(" --set {}", word(&format!("{key}={value}"))),
                });
                let command =
                    format!("marathon train {}{algorithm}{}{given}{settings}", stage.task, start(initialize_from));
                let until = stage.until.iter().map(|until| format!("  # until {until}")).collect::<String>();
                let of_seed = |seed: &u64| {
                    format!("{command} --seed {seed} --out {}{until}", path_word(&self.run_folder(i, Some(*seed))))
                };
                step.seeds.iter().map(of_seed).collect()
            }
            (StageKind::Distill { teachers, initialize_from, .. }, Job::Distill(of_stage)) => {
                let teachers: String = teachers.iter().map(|source| format!(" --teacher {}", path(source))).collect();
                let DistillOptions { hidden, steps, agents, lr, .. } = of_stage;
                let hidden: Vec<String> = hidden.iter().map(ToString::to_string).collect();
                let sizes = format!(" --hidden {} --steps {steps} --agents {agents} --lr {lr}", hidden.join(","));
                let command =
                    format!("marathon distill {}{given}{teachers}{}{sizes}", stage.task, start(initialize_from));
                let of_seed = |seed: &u64| {
                    let out = self.run_folder(i, Some(*seed)).join(state::POLICY);
                    format!("{command} --seed {seed} --out {}", path_word(&out))
                };
                step.seeds.iter().map(of_seed).collect()
            }
            (kind, _) => {
                let policies: String = kind.sources().into_iter().map(|source| format!(" {}", path(source))).collect();
                vec![format!("marathon average{policies}{given} --out {out}")]
            }
        }
    }
}

/// Checks a stage.
fn step(recipe: &Recipe, stage: &Stage, folder: PathBuf, seed: u64, threads: Option<usize>) -> Result<Step, RunError> {
    let path = &recipe.path;
    let key = |key: &str| format!("{}.{key}", stage.place.key);
    let mut seeds: Vec<u64> = stage.seeds.clone();
    let (job, given) = match &stage.kind {
        StageKind::Train { config, .. } => {
            let file = config.as_ref().map(|name| read_config(recipe, name)).transpose()?;
            let base = recipe.base(stage, file.as_ref().map(|(path, bytes)| (path.as_path(), &bytes[..])))?;
            let mut loaded = recipe.settings(stage, base)?;
            let run = &mut loaded.config.run;
            run.threads = threads.unwrap_or(run.threads);
            if seeds.is_empty() {
                seeds.push(run.seed);
            }
            loaded.config.validate()?;
            if stage.until.is_some() && loaded.keep_checkpoints == 0 {
                return Err(RunError::file(
                    path,
                    key("keep_checkpoints"),
                    0,
                    "1 or more, because the stage has 'until'",
                ));
            }
            let given = loaded.options.clone();
            (Job::Train(Box::new(loaded)), given)
        }
        StageKind::Distill { hidden, agents, lr, .. } => {
            let usual = DistillOptions::default();
            let options = DistillOptions {
                hidden: hidden.clone().unwrap_or(usual.hidden),
                initialize_from: None,
                steps: stage.steps.unwrap_or(usual.steps),
                agents: agents.unwrap_or(usual.agents),
                lr: lr.unwrap_or(usual.lr),
                seed: usual.seed,
                threads: threads.unwrap_or(usual.threads),
            };
            options.validate()?;
            if seeds.is_empty() {
                seeds.push(usual.seed);
            }
            (Job::Distill(options), stage.options.clone())
        }
        StageKind::Average { .. } => (Job::Average, stage.options.clone()),
    };
    seeds.iter_mut().for_each(|own| *own = own.wrapping_add(seed).wrapping_sub(1));
    let task = TaskConfig::named(&stage.task)?;
    check_options(path, &key("options"), &task.agent, &given)?;
    let task = task.with(&TaskOptions { given })?;
    let agent = registry::global().agent_with(&task.agent, &task.options)?;
    if stage.until.is_some() && agent.facts().roles.len() > 1 {
        return Err(RunError::file(path, key("until"), "a task with several roles", "a task with one role"));
    }
    let measures = [
        ("pick", stage.pick.as_ref().map(|pick| &pick.measure)),
        ("until", stage.until.as_ref().map(|until| &until.measure)),
    ];
    for (name, measure) in measures {
        if let Some(measure) = measure
            && let Some(expected) = measure::unknown(measure, &task)?
        {
            return Err(RunError::file(path, key(name), format!("'{measure}'"), expected));
        }
    }
    if let Some(pick) = stage.pick.as_ref().filter(|pick| pick.measure == measure::STEPS) {
        return Err(RunError::file(path, key("pick"), format!("'{pick}'"), "a measure of the policy"));
    }
    for source in stage.kind.sources() {
        if let Source::File(name) = source {
            policy_path(&beside(recipe, name))?;
        }
    }
    Ok(Step { folder, task, seeds, job })
}

/// Name and bytes of a configuration: a file beside the recipe, or one that comes with Marathon.
fn read_config(recipe: &Recipe, name: &str) -> Result<(PathBuf, Vec<u8>), RunError> {
    let path = beside(recipe, name);
    let of_program = || shipped(&recipe.path.to_string_lossy()).is_some_and(|text| text.as_bytes() == recipe.text);
    match shipped(name) {
        Some(text) if of_program() || !path.exists() => Ok((name.into(), text.into())),
        _ => {
            let bytes = budget::read(&path, &budget::CONFIG_FILE).map_err(RunError::io(&path, "read"))?;
            Ok((path, bytes))
        }
    }
}

/// A file that a recipe names, from the recipe's folder.
fn beside(recipe: &Recipe, name: &str) -> PathBuf {
    recipe.path.parent().unwrap_or(Path::new("")).join(name)
}

/// Calls `each` with the path and value of every setting.
fn flatten(section: &str, map: &Map<String, Value>, each: &mut impl FnMut(&str, &Value)) {
    for (key, value) in map {
        let key = if section.is_empty() { key.clone() } else { format!("{section}.{key}") };
        match value {
            Value::Object(inner) if !inner.contains_key("from") => flatten(&key, inner, each),
            value => each(&key, value),
        }
    }
}

//! A task of the registry with its arguments: what a run, a policy and a process need to make the same environments.

use crate::clips;
use crate::error::RunError;
use crate::text::whole;
use marathon_envs::options::{OF_LEARNING, Value};
use marathon_envs::shard::task_of_role;
use marathon_envs::{ModelSource, Options, ShardFactory, VecEnv, VecEnvOptions, registry};
use marathon_learn::PolicyMeta;
use marathon_learn::policy::options;
use marathon_physics::lanes::Isa;
use serde::{Deserialize, Serialize};
use std::path::Path;
use std::sync::Arc;

/// The argument that names motion clips.
pub(crate) const CLIP: &str = "clip";

/// The argument that says where episodes start, and its value for a start as every use of a policy has it.
pub(crate) const START: &str = "start";
pub(crate) const FIRST: &str = "first";

/// The argument that names a model file, which replaces the one that comes with Marathon.
const XML: &str = "xml_file";

/// Arguments of a task.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct TaskOptions {
    /// Option of the task, such as `clip=run`, `clip=my.bvh` or `start=first`; may be repeated. `marathon list TASK` lists
    /// them.
    #[cfg_attr(feature = "clap", arg(long = "option", value_name = "NAME=VALUE", value_parser = parse_option))]
    pub given: Vec<(String, Value)>,
}

impl From<Options> for TaskOptions {
    fn from(options: Options) -> Self {
        TaskOptions { given: options.iter().map(|(name, value)| (name.into(), value.clone())).collect() }
    }
}

/// A task of the registry with its arguments.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct TaskConfig {
    /// Registry name of the agent.
    pub agent: String,
    /// Its arguments; those that are not here have their defaults. Files have motion clips in a second entry, `clips`.
    #[serde(flatten, with = "options::beside")]
    pub options: Options,
}

impl TaskConfig {
    /// A task with its defaults, by any of its names.
    ///
    /// # Errors
    /// If there is none; the text names the nearest.
    pub fn named(name: &str) -> Result<Self, RunError> {
        let options = registry::robot_options(name).unwrap_or_default();
        TaskConfig { agent: registry::agent(name)?.facts().id, options }.with(&TaskOptions::default())
    }

    /// The task that a policy is for, without what only helped to learn; of a role's policy, that in which it has the role.
    pub fn of_policy(policy: &PolicyMeta) -> Self {
        let whole = Self::with_training_options(policy);
        TaskConfig { options: whole.options.without(&OF_LEARNING), ..whole }
    }

    /// The same with all arguments of a policy that has been [loaded](crate::policy_file::load_all): those that only help to learn are
    /// among them if the caller has asked for them.
    pub fn with_training_options(policy: &PolicyMeta) -> Self {
        TaskConfig { agent: task_of_role(&policy.agent).into(), options: policy.options.clone() }
    }

    /// The same with the option `start` set to `first`, if the agent has this option.
    ///
    /// # Errors
    /// If there is no such agent.
    pub fn starting_first(self) -> Result<Self, RunError> {
        if !registry::agent(&self.agent)?.has_option(START) {
            return Ok(self);
        }
        self.with(&TaskOptions { given: vec![(START.into(), Value::Text(FIRST.into()))] })
    }

    /// The same with more arguments, or other values of some. Clips in files are read; the argument then holds them.
    ///
    /// # Errors
    /// If the agent does not take an argument, or a file cannot be read or is no clip for the agent.
    pub fn with(mut self, options: &TaskOptions) -> Result<Self, RunError> {
        let agent = registry::agent(&self.agent)?;
        for (name, value) in &options.given {
            let value = match agent.takes_clips(name) {
                true => clips::read_all(value, self.options.get(name), &self.agent, &agent.model()?)?,
                false => value.clone(),
            };
            self.options.set(name, value);
        }
        // a policy or run may be used from another folder
        if let Some(source) = self.model()
            && let Some(path) = source.file()
            && self.options.get(XML) == Some(&Value::Text(path.to_string_lossy().into_owned()))
        {
            self.options.set(XML, Value::Text(whole(path).to_string_lossy().into_owned()));
        }
        Ok(self)
    }

    /// Refuses an option that names another model than the task's own name does, which is the path of a model.
    ///
    /// # Errors
    /// Names both models.
    pub fn check_model(&self, name: &str, options: &TaskOptions) -> Result<(), RunError> {
        let (Some(own), Some((_, other))) =
            (registry::robot_options(name), options.given.iter().rev().find(|(known, _)| known == XML))
        else {
            return Ok(());
        };
        let text = |value: &Value| match value {
            Value::Text(text) => text.clone(),
            value => value.to_string(),
        };
        let other = text(other);
        if own.get(XML).is_some_and(|own| whole(Path::new(&text(own))) == whole(Path::new(&other))) {
            return Ok(());
        }
        let problem = format!("{XML}={other} and the task {name} name two models, expected one of them");
        Err(RunError::option("option", problem))
    }

    /// The source of the task's model. `None` if the task does not take its arguments; creating its environments
    /// reports that error.
    pub fn model(&self) -> Option<ModelSource> {
        Some(registry::global().agent_with(&self.agent, &self.options).ok()?.facts().model)
    }

    /// Facts that the task has derived from its model, if it takes any model.
    pub fn findings(&self) -> Option<String> {
        registry::global().agent_with(&self.agent, &self.options).ok()?.findings()
    }

    /// The same with all arguments that another configuration of the agent has.
    pub fn overlay(mut self, other: &TaskConfig) -> Self {
        for (name, value) in other.options.iter() {
            self.options.set(name, value.clone());
        }
        self
    }

    /// Its environments.
    ///
    /// # Errors
    /// If there is no such agent, or it does not take the arguments.
    pub fn factory(&self) -> Result<Arc<dyn ShardFactory>, RunError> {
        self.factory_on(Isa::best())
    }

    /// Its environments for an instruction set.
    ///
    /// # Errors
    /// The same.
    pub fn factory_on(&self, isa: Isa) -> Result<Arc<dyn ShardFactory>, RunError> {
        Ok(registry::factory_with(&self.agent, &self.options, isa)?)
    }

    /// Agents of it, by the other options.
    ///
    /// # Errors
    /// The same, or if the options make no sense.
    pub fn vec_env(&self, options: &VecEnvOptions) -> Result<VecEnv, RunError> {
        let options = VecEnvOptions { options: self.options.clone(), ..options.clone() };
        Ok(VecEnv::new(&self.agent, &options)?)
    }
}

/// An argument of a task.
#[cfg(feature = "clap")]
fn parse_option(text: &str) -> Result<(String, Value), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() => {
            let value: Value = value.parse().unwrap_or_else(|never| match never {});
            Ok((name.trim().into(), value))
        }
        _ => Err("expected NAME=VALUE, such as clip=run".into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use marathon_learn::Activation;

    #[test]
    fn who_plays_a_policy_has_not_what_only_helped_to_learn() {
        let options = Options::new()
            .with("start_pushed_prob", 0.2)
            .with("end_on_fall_prob", 0.5)
            .with("fall_penalty", 20.0)
            .with("start", "adaptive");
        let spec = registry::factory_with("MarathonManController", &options, Isa::best()).unwrap().spec().clone();
        let meta = PolicyMeta::of(&spec, vec![8], Activation::Tanh);
        assert_eq!(meta.options.get("start_pushed_prob"), Some(&Value::Number(0.2)));
        let played = |task_config: TaskConfig| task_config.factory().unwrap().spec().options.clone();
        let options = played(TaskConfig::of_policy(&meta));
        for (name, value) in [("start_pushed_prob", 0.0), ("end_on_fall_prob", 0.0), ("fall_penalty", 20.0)] {
            assert_eq!(options.get(name), Some(&Value::Number(value)), "{name}");
        }
        assert_eq!(options.get("start"), Some(&Value::Text("adaptive".into())));
        let options = played(TaskConfig::of_policy(&meta).starting_first().unwrap());
        assert_eq!(options.get("start"), Some(&Value::Text("first".into())));
        // who can start in one way only does
        let hopper = TaskConfig::named("hopper").unwrap();
        assert_eq!(hopper.clone().starting_first().unwrap(), hopper);
    }
}

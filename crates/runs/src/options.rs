//! Options of runs, policies and videos: plain structs that every front end fills. The feature `clap` makes them
//! command-line arguments, with these texts as the help.

use crate::error::RunError;
use crate::inputs;
use crate::policy_file;
use crate::task_config::TaskOptions;
use marathon_envs::ShardFactory;
use marathon_learn::{Algorithm, Policy};
use marathon_physics::budget::VIDEO_SECONDS;
use std::path::PathBuf;
use std::sync::Arc;

/// How a policy is learned.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct LearnOptions {
    /// Configuration file of Marathon or ML-Agents. A file of Marathon changes the task's preset [default: the preset].
    #[cfg_attr(feature = "clap", arg(long, value_name = "F.yaml"))]
    pub config: Option<PathBuf>,
    /// Algorithm, with its default settings instead of the task's preset.
    #[cfg_attr(feature = "clap", arg(long, value_name = "NAME", value_parser = Algorithm::NAMES))]
    pub algo: Option<String>,
    /// Setting to change, such as `ppo.lr=3e-4`; may be repeated. `marathon config show TASK` lists them.
    #[cfg_attr(feature = "clap", arg(long, value_name = "KEY=VALUE"))]
    pub set: Vec<String>,
    /// Steps of all agents together; short for `--set run.total_steps=N`.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", value_parser = parse_steps))]
    pub steps: Option<u64>,
    /// Seed of all random numbers.
    #[cfg_attr(feature = "clap", arg(long, value_name = "S"))]
    pub seed: Option<u64>,
    /// Number of threads; 0 means one per core. The result does not depend on it.
    #[cfg_attr(feature = "clap", arg(long, value_name = "T"))]
    pub threads: Option<usize>,
}

/// Options of a training run. The configuration supplies options that are left out.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct RunOptions {
    /// How the policy is learned.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub learn: LearnOptions,
    /// Options of the task.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub task: TaskOptions,
    /// Number of agents: a multiple of 16, or 1, 2, 4 or 8, which cost as much as 16.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N"))]
    pub agents: Option<usize>,
    /// Number of processes that collect rollouts; 0 means that this process does. The result does not depend on it. Not
    /// for sac.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = 0))]
    pub processes: usize,
    /// Policy to start from instead of random weights: a file or the folder of a run, with hidden layers that are at most as
    /// wide. Observations are matched by name; new observations start with zero weight.
    #[cfg_attr(feature = "clap", arg(long, value_name = "POLICY"))]
    pub initialize_from: Option<PathBuf>,
    /// Folder for the results, new or empty [default: runs/TASK-N].
    #[cfg_attr(feature = "clap", arg(long, value_name = "DIR"))]
    pub out: Option<PathBuf>,
    /// Resume the run in this folder; with a larger `--steps`, extend it.
    #[cfg_attr(feature = "clap", arg(long, value_name = "DIR"))]
    pub resume: Option<PathBuf>,
}

impl LearnOptions {
    /// Refuses options that exclude each other.
    ///
    /// # Errors
    /// If there is no such algorithm, or a configuration beside it, which names its own.
    pub fn validate(&self) -> Result<(), RunError> {
        let Some(algo) = &self.algo else { return Ok(()) };
        if !Algorithm::NAMES.contains(&algo.as_str()) {
            let known = Algorithm::NAMES.join(", ");
            return Err(RunError::option("algo", format!("is {algo}, expected one of {known}")));
        }
        match &self.config {
            None => Ok(()),
            Some(_) => Err(RunError::option("algo", "and a configuration exclude each other: the file names its own")),
        }
    }
}

impl RunOptions {
    /// Refuses options that exclude each other.
    ///
    /// # Errors
    /// As [`LearnOptions::validate`], or if an option of new runs stands beside `resume`.
    pub fn validate(&self) -> Result<(), RunError> {
        self.learn.validate()?;
        let of_new_runs = [
            ("config", self.learn.config.is_some()),
            ("algo", self.learn.algo.is_some()),
            ("set", !self.learn.set.is_empty()),
            ("seed", self.learn.seed.is_some()),
            ("agents", self.agents.is_some()),
            ("option", !self.task.given.is_empty()),
            ("initialize_from", self.initialize_from.is_some()),
            ("out", self.out.is_some()),
        ];
        match of_new_runs.into_iter().find(|(_, given)| *given && self.resume.is_some()) {
            Some((name, _)) => Err(RunError::NewRunOnly { name }),
            None => Ok(()),
        }
    }
}

/// A policy and its task.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct PolicySource {
    /// Policy file (.safetensors or .onnx) or folder of a run.
    pub policy: PathBuf,
    /// Task of the policy, or the path of another model for a policy of Robot-v0 [default: the task that it was trained for].
    #[cfg_attr(feature = "clap", arg(long, value_name = "AGENT"))]
    pub agent: Option<String>,
    /// Options of the task that differ from those of the policy's training.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub task: TaskOptions,
}

impl PolicySource {
    /// Reads the policy and makes its task. The policy notes the arguments that the task has.
    ///
    /// # Errors
    /// If there is no such file, it is no policy, it is for another agent, or the agent does not take the arguments.
    pub fn load(&self) -> Result<(Policy, Arc<dyn ShardFactory>), RunError> {
        policy_file::load(&self.policy, self.agent.as_deref(), &self.task)
    }

    /// A note for the user if the model of a run's task has changed since the run began.
    pub fn note(&self) -> Option<String> {
        inputs::changed(&self.policy, &policy_file::task_for(&self.policy, self.agent.as_deref(), &self.task).ok()?)
    }

    /// The same with the policies of all roles of the task, in their order; those of the others lie beside the first one.
    ///
    /// # Errors
    /// The same, and if one of them is missing.
    pub fn load_all(&self) -> Result<(Vec<Policy>, Arc<dyn ShardFactory>), RunError> {
        policy_file::load_all(&self.policy, self.agent.as_deref(), &self.task)
    }
}

/// Length and frame rate of a video.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct VideoOptions {
    /// Length of the video, s [default: 8; 2 for a strip of frames].
    #[cfg_attr(feature = "clap", arg(long, value_name = "S", allow_negative_numbers = true))]
    pub seconds: Option<f64>,
    /// Simulated time before the video starts, s.
    #[cfg_attr(feature = "clap", arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true))]
    pub start: f64,
    /// Frames per second of a video [default: 25 for .gif, 50 for .mp4, 30 in the game].
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", allow_negative_numbers = true))]
    pub fps: Option<f64>,
}

impl VideoOptions {
    /// Highest frame rate, frames per second.
    pub const MOST_FPS: f64 = 1000.0;
    /// Lowest frame rate, frames per second. A video has at least one frame.
    pub const LEAST_FPS: f64 = 0.1;

    /// Refuses lengths and frame rates that make no video.
    ///
    /// # Errors
    /// Names the option, its value and what was expected.
    pub fn validate(&self) -> Result<(), RunError> {
        let wrong = |name, x: f64, expected: &str| Err(RunError::option(name, format!("is {x}, expected {expected}")));
        match (self.seconds, self.fps) {
            (Some(x), _) if x.is_nan() || x <= 0.0 => return wrong("seconds", x, "a number above 0"),
            (_, Some(x)) if !(Self::LEAST_FPS..=Self::MOST_FPS).contains(&x) => {
                return wrong("fps", x, &format!("a number from {} to {}", Self::LEAST_FPS, Self::MOST_FPS));
            }
            _ if self.start.is_nan() || self.start < 0.0 => return wrong("start", self.start, "0 or more"),
            _ => {}
        }
        for (name, seconds) in [("seconds", self.seconds.unwrap_or(0.0)), ("start", self.start)] {
            VIDEO_SECONDS.check(seconds).map_err(|error| RunError::option(name, error.to_string()))?;
        }
        Ok(())
    }
}

/// Most steps on a command line.
#[cfg(feature = "clap")]
const MOST_STEPS: u64 = 1_000_000_000_000_000;

/// A number of steps, with `_` or `,` between digits, or in the short forms `500k`, `2.5M`, `1e6`.
#[cfg(feature = "clap")]
pub(crate) fn parse_steps(text: &str) -> Result<u64, String> {
    let steps = marathon_config::steps(text).filter(|steps| (1..=MOST_STEPS).contains(steps));
    steps.ok_or_else(|| "expected a positive whole number of steps such as 4000000, 4_000_000, 4M, 500k or 4e6".into())
}

#[cfg(all(test, feature = "clap"))]
mod tests {
    use super::*;

    #[test]
    fn steps_have_short_forms() {
        for (text, steps) in [
            ("4000000", 4_000_000),
            ("4_000_000", 4_000_000),
            ("2.5M", 2_500_000),
            ("1e6", 1_000_000),
            ("4.35M", 4_350_000),
            ("0.4k", 400),
        ] {
            assert_eq!(parse_steps(text), Ok(steps));
        }
        for text in ["0", "-3", "1.5", "0.0004k", "1e16", "many", "", "inf", "nan", "k"] {
            assert!(parse_steps(text).is_err(), "{text}");
        }
    }
}

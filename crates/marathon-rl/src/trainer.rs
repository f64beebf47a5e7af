//! Training by a builder whose defaults are the tuned settings of the task.

use crate::{Error, Result};
use marathon_envs::Value;
use marathon_learn::{Control, EvalOptions, Evaluation, IterationStats, Policy};
use marathon_physics::Isa;
use marathon_runs::{Outcome, RunOptions, Session, Task, TaskConfig};
use std::fmt::Display;
use std::path::PathBuf;

/// Trains a policy for a task.
///
/// Settings that you leave out have the tuned values that come with the task, as in `marathon train TASK`. The same seed
/// gives the same policy for any number of threads and any instruction set.
///
/// ```no_run
/// use marathon_rl::prelude::*;
///
/// let run = Trainer::new("Walker2d-v0")?
///     .steps(8_000_000)
///     .seed(7)
///     .folder("runs/walker")
///     .on_iteration(|stats| {
///         println!("{:9} steps, return {:.1?}", stats.steps, stats.learned.return_mean);
///         Control::Continue
///     })
///     .run()?;
/// println!("{:?}", run.evaluation);
/// # Ok::<(), marathon_rl::Error>(())
/// ```
pub struct Trainer<'a> {
    /// `None` for a resumed run: its folder names the task.
    task: Option<Task<'a>>,
    options: RunOptions,
    on_iteration: Box<dyn FnMut(&IterationStats) -> Control + 'a>,
}

impl<'a> Trainer<'a> {
    /// A new run of a task, by any of its names: `hopper`, `Hopper-v0`.
    ///
    /// # Errors
    /// If there is no such task; the message names the nearest.
    pub fn new(task: &str) -> Result<Self> {
        Ok(Self::of(Some(Task::named(task)?), RunOptions::default()))
    }

    /// Continues the run in a folder from its last checkpoint, with the bits of a run that was never interrupted.
    pub fn resume(folder: impl Into<PathBuf>) -> Self {
        Self::of(None, RunOptions { resume: Some(folder.into()), ..Default::default() })
    }

    fn of(task: Option<Task<'a>>, options: RunOptions) -> Self {
        Trainer { task, options, on_iteration: Box::new(|_| Control::Continue) }
    }

    /// Agent-steps of the whole run.
    pub fn steps(mut self, steps: u64) -> Self {
        self.options.learn.steps = Some(steps);
        self
    }

    /// Seed of all random numbers.
    pub fn seed(mut self, seed: u64) -> Self {
        self.options.learn.seed = Some(seed);
        self
    }

    /// Threads; 0, the default, means one per processor core. The policy does not depend on it.
    pub fn threads(mut self, threads: usize) -> Self {
        self.options.learn.threads = Some(threads);
        self
    }

    /// Agents that act side by side: a multiple of 16, or 1, 2, 4 or 8.
    pub fn agents(mut self, agents: usize) -> Self {
        self.options.agents = Some(agents);
        self
    }

    /// An argument of the task: `option("clip", "backflip")`, `option("ctrl_cost_weight", 1e-4)`.
    pub fn option(mut self, name: &str, value: impl Into<Value>) -> Self {
        self.options.task.given.push((name.into(), value.into()));
        self
    }

    /// A setting of the configuration: `set("ppo.lr", 3e-4)`. `marathon config show TASK` prints all of them.
    pub fn set(mut self, key: &str, value: impl Display) -> Self {
        self.options.learn.set.push(format!("{key}={value}"));
        self
    }

    /// A configuration file, whose settings replace those of the task.
    pub fn config(mut self, file: impl Into<PathBuf>) -> Self {
        self.options.learn.config = Some(file.into());
        self
    }

    /// A policy to start from in place of random weights: a file, or the folder of a run.
    pub fn start_from(mut self, policy: impl Into<PathBuf>) -> Self {
        self.options.initialize_from = Some(policy.into());
        self
    }

    /// Writes checkpoints, reports and the policy to this folder, new or empty. Without it, the run writes no files.
    pub fn folder(mut self, folder: impl Into<PathBuf>) -> Self {
        self.options.out = Some(folder.into());
        self
    }

    /// Calls a function after each iteration. It can stop the run; a run that writes to a folder can be resumed.
    pub fn on_iteration(mut self, watch: impl FnMut(&IterationStats) -> Control + 'a) -> Self {
        self.on_iteration = Box::new(watch);
        self
    }

    /// Trains to the last step or until the function of [`Trainer::on_iteration`] stops the run, then evaluates the policy.
    ///
    /// # Errors
    /// If an option or the configuration is invalid, the folder holds something else, or files cannot be written. The
    /// message says what is saved and how to continue.
    pub fn run(mut self) -> Result<Outcome> {
        let without_files = self.options.out.is_none() && self.options.resume.is_none();
        let (session, _) = Session::open(self.task, &self.options, None, without_files)?;
        session.carry_out(false, &mut *self.on_iteration)
    }
}

/// Plays a policy in the task that it was trained for, with its best actions.
///
/// # Errors
/// If the task no longer exists, or does not take the arguments that the policy notes.
pub fn evaluate(policy: &Policy, options: &EvalOptions) -> Result<Evaluation> {
    let factory = TaskConfig::of_policy(policy.meta()).factory()?;
    policy.check(factory.spec())?;
    marathon_learn::evaluate(&*factory, Isa::best(), policy, options).map_err(Error::from)
}

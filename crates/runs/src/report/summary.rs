//! A summary of a run: `summary.json`, and the same as text.

use super::csv::History;
use crate::imitation::Imitation;
use crate::text::{duration, path_json, short, thousands, unsigned_zero};
use marathon_envs::Options;
use marathon_learn::policy::options;
use marathon_learn::{Checkpoint, Evaluation};
use serde::{Deserialize, Serialize};
use std::path::PathBuf;

/// Episodes of the evaluation at the end of a run.
pub const EPISODES: usize = 100;

/// Contents of `summary.json` and of the output of `train --json`.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Summary {
    /// Registry name of the agent.
    pub agent: String,
    /// Options of its task.
    #[serde(default, skip_serializing_if = "Options::is_empty", with = "options")]
    pub options: Options,
    /// Folder of the run.
    #[serde(serialize_with = "path_json")]
    pub folder: PathBuf,
    /// Seed of the run.
    pub seed: u64,
    /// Agent-steps done.
    pub steps: u64,
    /// Seconds of training over all parts of an interrupted run, without evaluation and writing files.
    pub wall_seconds: f64,
    /// Processor seconds of all threads during that time.
    pub cpu_seconds: f64,
    /// Agent-steps per processor second.
    pub steps_per_cpu_second: f64,
    /// Number of times that the state of an agent became non-finite in training and was reset.
    pub diverged: u64,
    /// Minibatches that were skipped because their gradient was not finite.
    pub skipped_minibatches: u64,
    /// Whether the run was stopped before its last step.
    pub interrupted: bool,
    /// Evaluation of the policy. `None` for an interrupted run.
    pub eval: Option<Evaluation>,
    /// How well the policy follows each clip, if its task follows clips.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub imitation: Vec<Imitation>,
}

impl Summary {
    /// Summarizes a run from its last checkpoint and rows, in a folder.
    pub fn new(folder: PathBuf, checkpoint: &Checkpoint, history: &History, eval: Option<Evaluation>) -> Self {
        let (steps, (wall_seconds, cpu_seconds)) = (checkpoint.steps(), checkpoint.seconds());
        Self {
            agent: checkpoint.agent().into(),
            options: Options::new(),
            folder,
            seed: checkpoint.config().run.seed,
            steps,
            wall_seconds,
            cpu_seconds,
            steps_per_cpu_second: if cpu_seconds > 0.0 { steps as f64 / cpu_seconds } else { 0.0 },
            diverged: history.column("diverged").into_iter().flatten().sum::<f64>() as u64,
            skipped_minibatches: history.column("skipped_minibatches").last().copied().flatten().unwrap_or(0.0) as u64,
            interrupted: eval.is_none(),
            eval,
            imitation: Vec::new(),
        }
    }

    /// One line about the training.
    pub fn training_line(&self) -> String {
        format!(
            "{}: {} steps in {} ({} of processor time, {} steps per processor second)",
            self.agent,
            thousands(self.steps),
            duration(self.wall_seconds),
            duration(self.cpu_seconds),
            short(self.steps_per_cpu_second)
        )
    }
}

/// An evaluation as a small table. `limit` is the longest episode in decisions, `dt` seconds per decision.
pub fn evaluation_table(e: &Evaluation, limit: usize, dt: f64) -> String {
    let seconds = e.length_mean * dt;
    let broken = match e.diverged {
        0 => String::new(),
        n => format!(" ({n} of them because the simulation broke down)"),
    };
    let metrics: String = e.metrics.iter().map(|(name, x)| format!("\n  {name:8}  {x:.4}")).collect();
    format!(
        "  distance  {:.1} m in {seconds:.1} s\n\
         \x20 speed     {:.2} m/s\n\
         \x20 return    {:.1} ± {:.1}, from {:.1} to {:.1}\n\
         \x20 length    {:.0} of {limit} decisions\n\
         \x20 falls     {} of {} episodes{broken}{metrics}",
        unsigned_zero(e.distance_mean, 1),
        unsigned_zero(e.speed_mean, 2),
        e.return_mean,
        e.return_std,
        e.return_min,
        e.return_max,
        e.length_mean,
        thousands(e.falls),
        thousands(e.episodes),
    )
}

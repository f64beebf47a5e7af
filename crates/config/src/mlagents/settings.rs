//! Settings from ML-Agents' own keys, with ML-Agents' defaults for missing keys.

use super::behavior::{Behavior, Format};
use crate::error::ConfigError;
use crate::keys::MOST_EPOCHS;
use crate::section::{Range, Section};
use marathon_learn::Algorithm;

/// Most of anything that is counted in a file.
const MOST: u64 = 1 << 31;

/// How a value moves over the run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decay {
    Constant,
    Linear,
}

/// ML-Agents' settings of a behavior that mean something here. The names are the file's.
#[derive(Clone, Debug)]
pub struct Settings {
    pub batch_size: u64,
    pub buffer_size: u64,
    pub learning_rate: f64,
    pub learning_rate_schedule: Decay,
    pub beta: f64,
    pub beta_schedule: Decay,
    pub epsilon: f64,
    pub epsilon_schedule: Decay,
    pub lambd: f64,
    pub num_epoch: u64,
    pub normalize: bool,
    pub hidden_units: u64,
    pub num_layers: u64,
    pub gamma: f64,
    pub max_steps: u64,
    pub time_horizon: u64,
    pub summary_freq: u64,
    pub checkpoint_interval: u64,
    pub keep_checkpoints: u64,
}

impl Settings {
    /// Reads them.
    ///
    /// # Errors
    /// If a value is of the wrong kind or out of range.
    pub fn read(behavior: &Behavior<'_>) -> Result<Self, ConfigError> {
        let Behavior { top, hyperparameters, network, extrinsic, format, base, .. } = behavior;
        // ML-Agents' sizes for PPO; the others learn from each rollout at once
        let (buffer, horizon) = match &base.algorithm {
            Algorithm::Ppo(_) => (10_240, 64),
            Algorithm::Sac(_) => (50_000, 64),
            _ => (base.run.rollout_steps(), base.run.horizon as u64),
        };
        let buffer_size = hyperparameters.count("buffer_size", 16..=MOST, buffer)?;
        let batch = match &base.algorithm {
            Algorithm::Ppo(_) => 1024,
            Algorithm::Sac(_) => 128,
            _ => buffer_size,
        };
        // defaults that differ: steps in all, steps between summaries and checkpoints
        let (max_steps, summary_freq, checkpoint_interval) = match format {
            Format::Current => (500_000, 50_000, 500_000),
            Format::Legacy => (50_000, 1_000, 50_000),
        };
        let schedule = if let Algorithm::Sac(_) = base.algorithm { Decay::Constant } else { Decay::Linear };
        let learning_rate_schedule = decay(hyperparameters, "learning_rate_schedule", schedule)?;
        // Baselines moves nothing but the rate
        let beta_schedule = match &base.algorithm {
            Algorithm::Ppo(_) => learning_rate_schedule,
            _ => Decay::Constant,
        };
        let max_steps = top.count("max_steps", 1..=1 << 53, max_steps)?;
        let keep_checkpoints = top.count("keep_checkpoints", 1..=MOST, 5)?;
        let even = *format == Format::Current && top.flag("even_checkpoints", false)?;
        let checkpoint_interval = match even {
            true => (max_steps / keep_checkpoints).max(1),
            false => top.count("checkpoint_interval", 1..=1 << 53, checkpoint_interval)?,
        };
        // those that an algorithm has no use for may be any
        let (lr, beta, epsilon, lambd, epochs) = match &base.algorithm {
            Algorithm::Ppo(ppo) => (ppo.lr, ppo.entropy_coef.from, ppo.clip.from, ppo.gae_lambda, ppo.epochs),
            Algorithm::A2c(a2c) => (a2c.lr, a2c.entropy_coef.from, 0.2, a2c.gae_lambda, 1),
            Algorithm::Acktr(acktr) => (acktr.lr, acktr.entropy_coef.from, 0.2, acktr.gae_lambda, 1),
            Algorithm::Sac(sac) => (sac.lr, 0.0, 0.2, 0.95, 1),
        };
        Ok(Settings {
            batch_size: hyperparameters.count("batch_size", 16..=MOST, batch)?,
            buffer_size,
            learning_rate: hyperparameters.number("learning_rate", Range::Positive, lr)?,
            learning_rate_schedule,
            beta: hyperparameters.number("beta", Range::NotNegative, beta)?,
            beta_schedule: decay(hyperparameters, "beta_schedule", beta_schedule)?,
            epsilon: hyperparameters.number("epsilon", Range::Positive, epsilon)?,
            epsilon_schedule: decay(hyperparameters, "epsilon_schedule", learning_rate_schedule)?,
            lambd: hyperparameters.number("lambd", Range::Fraction, lambd)?,
            num_epoch: hyperparameters.count("num_epoch", 1..=MOST_EPOCHS, epochs as u64)?,
            normalize: network.flag("normalize", base.statistics.normalize_observations)?,
            hidden_units: network.count(
                "hidden_units",
                1..=65_536,
                base.network.hidden.first().map_or(128, |w| *w as u64),
            )?,
            num_layers: network.count("num_layers", 1..=64, 2)?,
            gamma: extrinsic.number("gamma", Range::Fraction, base.task_reward().gamma)?,
            max_steps,
            time_horizon: top.count("time_horizon", 1..=MOST, horizon)?,
            summary_freq: top.count("summary_freq", 1..=1 << 53, summary_freq)?,
            checkpoint_interval,
            keep_checkpoints,
        })
    }
}

fn decay(section: &Section<'_>, key: &str, default: Decay) -> Result<Decay, ConfigError> {
    let Some(entry) = section.get(key) else { return Ok(default) };
    Ok([Decay::Constant, Decay::Linear][entry.word(&["constant", "linear"])?])
}

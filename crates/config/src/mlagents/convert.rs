//! From a behavior of a file to the trainer's configuration.

use super::behavior::{Behavior, Notes};
use super::settings::{Decay, Settings};
use crate::error::ConfigError;
use crate::loaded::Loaded;
use crate::section::{Range, Section};
use marathon_learn::{
    A2c, Acktr, Algorithm, BLOCK, Error, LrSchedule, NetworkConfig, Ppo, RewardConfig, RewardKind, RunConfig, Sac,
    Schedule, StatisticsConfig, TrainConfig,
};
use std::path::Path;

/// Agents in a scene of the paper, which a file of its time does not say.
const PAPER_AGENTS: u64 = 16;
/// Most agents that are chosen without being asked for.
const MOST_AGENTS: u64 = 1024;

/// ML-Agents decays to these, not to zero.
const LAST_BETA: f64 = 1e-5;
const LAST_EPSILON: f64 = 0.1;

/// The trainer's configuration, with the values of its base for all that the file leaves out.
///
/// # Errors
/// If a value is wrong, or the values do not go together.
pub fn convert(path: &Path, behavior: Behavior<'_>) -> Result<Loaded, ConfigError> {
    let settings = Settings::read(&behavior)?;
    let Behavior { top, hyperparameters, network, mut notes, seed, base, signals, extrinsic, steps_per_agent, .. } =
        behavior;
    let strength = extrinsic.number("strength", Range::Positive, 1.0)?;
    let agents = agents(&settings, &base, steps_per_agent);
    // an update waits until the buffer is full
    let is_sac = matches!(base.algorithm, Algorithm::Sac(_));
    let horizon = if is_sac { base.run.horizon as u64 } else { settings.buffer_size.div_ceil(agents) };
    note_others(&hyperparameters, &base.algorithm, &mut notes);
    if let Some(entry) = top.get("time_horizon").filter(|_| settings.time_horizon != horizon && !is_sac) {
        let why = "each of the N agents adds M decisions to a rollout and the values of the states reached stand for the rest";
        notes.ignored(&entry, &why.replace("N", &agents.to_string()).replace("M", &horizon.to_string()));
    }
    let scale = if steps_per_agent { agents } else { 1 };
    if let Some(entry) = top.get("max_steps").filter(|_| scale > 1) {
        let all = settings.max_steps.saturating_mul(scale);
        notes.about(&entry, &format!("counts the steps of each agent: {all} steps of {scale} agents in all"));
    }

    let algorithm = match base.algorithm {
        Algorithm::Ppo(base) => Algorithm::Ppo(ppo(&settings, base)),
        Algorithm::A2c(base) => Algorithm::A2c(A2c {
            lr: settings.learning_rate,
            lr_schedule: settings.lr_schedule(),
            gae_lambda: settings.lambd,
            entropy_coef: entropy_coef(&settings),
            ..base
        }),
        Algorithm::Acktr(base) => Algorithm::Acktr(Acktr {
            lr: settings.learning_rate,
            lr_schedule: settings.lr_schedule(),
            gae_lambda: settings.lambd,
            entropy_coef: entropy_coef(&settings),
            ..base
        }),
        Algorithm::Sac(base) => Algorithm::Sac(sac(&hyperparameters, &settings, base, agents * horizon)?),
    };
    // alone, its scale cancels
    let strength = if signals.is_empty() { 1.0 } else { strength };
    let task = RewardConfig { kind: RewardKind::Task, strength, gamma: settings.gamma };
    let config = TrainConfig {
        run: RunConfig {
            agents: agents as usize,
            horizon: horizon as usize,
            total_steps: settings.max_steps.saturating_mul(scale),
            seed: seed.unwrap_or(base.run.seed),
            ..base.run
        },
        network: NetworkConfig {
            hidden: vec![settings.hidden_units as usize; settings.num_layers as usize],
            ..base.network
        },
        statistics: StatisticsConfig { normalize_observations: settings.normalize, ..base.statistics },
        rewards: [task].into_iter().chain(signals).collect(),
        algorithm,
        roles: Default::default(),
    };
    config.validate().map_err(|source| misfit(source, path, [&top, &hyperparameters, &network]))?;
    Ok(Loaded {
        config,
        options: Vec::new(),
        buffer: (!is_sac).then_some(settings.buffer_size),
        summary_freq: settings.summary_freq.saturating_mul(scale),
        checkpoint_interval: settings.checkpoint_interval.saturating_mul(scale),
        keep_checkpoints: settings.keep_checkpoints as usize,
        notes: notes.0,
    })
}

/// Keys of ML-Agents, by the last names of the settings that they become.
const KEYS: [(&str, &str); 13] = [
    ("batch", "batch_size"),
    ("minibatches", "batch_size"),
    ("replay", "buffer_size"),
    ("horizon", "buffer_size"),
    ("warmup", "buffer_init_steps"),
    ("epochs", "num_epoch"),
    ("lr", "learning_rate"),
    ("clip", "epsilon"),
    ("entropy_coef", "beta"),
    ("gae_lambda", "lambd"),
    ("init_alpha", "init_entcoef"),
    ("hidden", "hidden_units"),
    ("total_steps", "max_steps"),
];

/// An error of settings that do not go together, at the file's own key if it has set the one that is at fault.
fn misfit(error: Error, path: &Path, sections: [&Section<'_>; 3]) -> ConfigError {
    if let Error::Config { field, expected, .. } = &error {
        let last = field.rsplit('.').next().unwrap_or(field);
        let key = KEYS.iter().find(|(setting, _)| *setting == last).map_or(last, |(_, key)| key);
        if let Some(entry) = sections.into_iter().find_map(|section| section.set(key)) {
            return ConfigError::value(entry.place, entry.node.describe(), expected);
        }
    }
    ConfigError::Combination { path: path.into(), source: error }
}

/// As many agents as fill the buffer with one stretch of `time_horizon` decisions each.
fn agents(settings: &Settings, base: &TrainConfig, steps_per_agent: bool) -> u64 {
    let block = BLOCK as u64;
    match base.algorithm {
        Algorithm::A2c(_) | Algorithm::Acktr(_) | Algorithm::Sac(_) => base.run.agents as u64,
        Algorithm::Ppo(_) if steps_per_agent => PAPER_AGENTS,
        Algorithm::Ppo(_) => (settings.buffer_size / settings.time_horizon).clamp(block, MOST_AGENTS) / block * block,
    }
}

/// Notes settings that mean nothing to the algorithm.
fn note_others(hyperparameters: &Section<'_>, algorithm: &Algorithm, notes: &mut Notes) {
    let (Algorithm::A2c(_) | Algorithm::Acktr(_)) = algorithm else { return };
    for (keys, why) in [
        (["epsilon", "epsilon_schedule"], "bounds no ratio"),
        (["num_epoch", "batch_size"], "makes one step on each rollout"),
    ] {
        for entry in keys.into_iter().filter_map(|key| hyperparameters.get(key)) {
            notes.ignored(&entry, &format!("{} {why}", algorithm.name()));
        }
    }
}

fn ppo(settings: &Settings, base: Ppo) -> Ppo {
    let epsilon = settings.epsilon;
    Ppo {
        minibatches: (settings.buffer_size / settings.batch_size).max(1) as usize,
        epochs: settings.num_epoch as usize,
        lr: settings.learning_rate,
        value_lr: settings.learning_rate,
        lr_schedule: settings.lr_schedule(),
        gae_lambda: settings.lambd,
        clip: decayed(epsilon, settings.epsilon_schedule, LAST_EPSILON),
        entropy_coef: entropy_coef(settings),
        ..base
    }
}

/// `rollout` is the number of steps of a rollout.
fn sac(hyperparameters: &Section<'_>, settings: &Settings, base: Sac, rollout: u64) -> Result<Sac, ConfigError> {
    let steps_per_update = hyperparameters.number("steps_per_update", Range::Positive, 1.0)?;
    Ok(Sac {
        lr: settings.learning_rate,
        value_lr: settings.learning_rate,
        lr_schedule: settings.lr_schedule(),
        replay: settings.buffer_size as usize,
        warmup: hyperparameters.count("buffer_init_steps", 0..=1 << 53, 0)?,
        batch: settings.batch_size as usize,
        updates: (rollout as f64 / steps_per_update).round().max(1.0) as usize,
        tau: hyperparameters.number("tau", Range::Positive, 0.005)?,
        init_alpha: hyperparameters.number("init_entcoef", Range::Positive, 1.0)?,
        ..base
    })
}

fn entropy_coef(settings: &Settings) -> Schedule {
    decayed(settings.beta, settings.beta_schedule, LAST_BETA)
}

/// A setting that stays, or decays to where ML-Agents' decay ends; a decay never raises.
fn decayed(from: f64, decay: Decay, last: f64) -> Schedule {
    match decay {
        Decay::Constant => Schedule::constant(from),
        Decay::Linear => Schedule { from, to: from.min(last) },
    }
}

impl Settings {
    fn lr_schedule(&self) -> LrSchedule {
        match self.learning_rate_schedule {
            Decay::Constant => LrSchedule::Constant,
            Decay::Linear => LrSchedule::Linear,
        }
    }
}

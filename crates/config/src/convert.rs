//! From a behavior of a file to the trainer's configuration.

use super::Loaded;
use super::behavior::{Behavior, Notes};
use super::error::ConfigError;
use super::section::{Entry, Range, Section};
use super::settings::{Decay, Settings};
use marathon_envs::options::Value;
use marathon_learn::{
    A2c, Acktr, Activation, Algorithm, BLOCK, Deviations, Init, Moving, NetworkConfig, Ppo, Ratio, RewardConfig,
    RewardKind, RunConfig, Sac, Schedule, StatisticsConfig, TrainConfig,
};
use std::collections::BTreeSet;
use std::path::Path;

/// Agents in a scene of the paper, which a file of its time does not say.
const PAPER_AGENTS: u64 = 16;
/// Most agents that are chosen without being asked for.
const MOST_AGENTS: u64 = 1024;

/// ML-Agents decays to these, not to zero.
const LAST_BETA: f64 = 1e-5;
const LAST_EPSILON: f64 = 0.1;

/// Keys of the section that only Marathon reads, with any algorithm.
const COMMON: [&str; 18] = [
    "agents",
    "horizon",
    "rollouts",
    "policy_average",
    "actor_hidden",
    "critic_hidden",
    "activation",
    "initialization",
    "schedule",
    "follow_statistics",
    "observation_clip",
    "scale_rewards",
    "statistics_cap",
    "seed",
    "threads",
    "without",
    "steps_per_agent",
    "options",
];

/// Those of the algorithms that learn from their own rollouts.
const ON_POLICY: [&str; 6] =
    ["final_entropy_coef", "action_clip", "init_log_std", "min_std", "final_min_std", "max_std"];
/// Those of each algorithm's own settings.
const PPO: [&str; 11] = [
    "minibatches",
    "value_lr",
    "value_warmup",
    "target_kl",
    "final_target_kl",
    "lr_range",
    "max_grad_norm",
    "adam_epsilon",
    "value_clip",
    "ratio",
    "final_clip",
];
const A2C: [&str; 4] = ["max_grad_norm", "value_coef", "rms_decay", "rms_epsilon"];
const ACKTR: [&str; 6] = ["value_coef", "kl_clip", "momentum", "damping", "stats_decay", "inverse_every"];
const SAC: [&str; 4] = ["value_lr", "adam_epsilon", "updates", "n_step"];

/// Arguments of the task. Whether it takes them, the task knows.
fn options(marathon: &Section<'_>) -> Result<Vec<(String, Value)>, ConfigError> {
    let read = |entry: Entry<'_>| {
        let text = entry.word_of_any_kind("a number, a word, true or false")?;
        Ok((entry.key.to_string(), text.parse().unwrap_or_else(|never| match never {})))
    };
    marathon.section("options")?.entries().map(read).collect()
}

/// The trainer's configuration, with the values of its base for all that the file leaves out.
///
/// # Errors
/// If a value is wrong, or the values do not go together.
pub fn convert(path: &Path, behavior: Behavior<'_>) -> Result<Loaded, ConfigError> {
    let settings = Settings::read(&behavior)?;
    let Behavior { top, hyperparameters, marathon, mut notes, seed, base, signals, extrinsic, .. } = behavior;
    let strength = extrinsic.number("strength", Range::Positive, 1.0)?;
    marathon.only(&[&COMMON[..], &ON_POLICY, &PPO, &A2C, &ACKTR, &SAC].concat())?;

    let steps_per_agent = marathon.flag("steps_per_agent", behavior.steps_per_agent)?;
    let agents = agents(&marathon, &settings, &base, steps_per_agent)?;
    // an update waits until the buffer is full
    let is_sac = matches!(base.algorithm, Algorithm::Sac(_));
    let rollout = if is_sac { base.run.horizon as u64 } else { settings.buffer_size.div_ceil(agents) };
    let horizon = marathon.count("horizon", 1..=1 << 31, rollout)?;
    if let Some(entry) = hyperparameters.get("buffer_size").filter(|_| horizon != rollout) {
        notes.ignored(&entry, &format!("'horizon' of the 'marathon:' section makes rollouts of {}", agents * horizon));
    }
    note_others(&hyperparameters, &marathon, &base.algorithm, &mut notes);
    if let Some(entry) = top.get("time_horizon").filter(|_| settings.time_horizon != horizon && !is_sac) {
        let why = "each of the N agents adds M decisions to a rollout and the values of the states reached stand for the rest";
        notes.ignored(&entry, &why.replace("N", &agents.to_string()).replace("M", &horizon.to_string()));
    }
    let scale = if steps_per_agent { agents } else { 1 };
    if let Some(entry) = top.get("max_steps").filter(|_| scale > 1) {
        let all = settings.max_steps.saturating_mul(scale);
        notes.about(&entry, &format!("counts the steps of each agent: {all} steps of {scale} agents in all"));
    }

    let schedule = schedule(&marathon, &hyperparameters, settings.learning_rate_schedule, &mut notes)?;
    let from = From { marathon: &marathon, hyperparameters: &hyperparameters, settings: &settings, schedule };
    let algorithm = match base.algorithm {
        Algorithm::Ppo(base) => Algorithm::Ppo(from.ppo(base)?),
        Algorithm::A2c(base) => Algorithm::A2c(from.a2c(base)?),
        Algorithm::Acktr(base) => Algorithm::Acktr(from.acktr(base)?),
        Algorithm::Sac(base) => Algorithm::Sac(from.sac(base, agents * horizon)?),
    };
    let hidden = vec![settings.hidden_units as usize; settings.num_layers as usize];
    let actor_hidden = widths(&marathon, "actor_hidden", hidden)?;
    let (network, statistics) = (&base.network, &base.statistics);
    // alone, its scale cancels
    let strength = if signals.is_empty() { 1.0 } else { strength };
    let task = RewardConfig { kind: RewardKind::Task, strength, gamma: settings.gamma };
    let config = TrainConfig {
        run: RunConfig {
            agents: agents as usize,
            horizon: horizon as usize,
            rollouts: marathon.count("rollouts", 1..=1 << 31, base.run.rollouts as u64)? as usize,
            total_steps: settings.max_steps.saturating_mul(scale),
            policy_average: marathon.number("policy_average", Range::Fraction, base.run.policy_average)?,
            seed: marathon.count("seed", 0..=u64::MAX, seed.unwrap_or(base.run.seed))?,
            threads: marathon.count("threads", 0..=65_536, base.run.threads as u64)? as usize,
        },
        network: NetworkConfig {
            critic_hidden: widths(&marathon, "critic_hidden", actor_hidden.clone())?,
            actor_hidden,
            activation: one_of(&marathon, "activation", Activation::ALL.map(|a| (a.name(), a)), network.activation)?,
            initialization: one_of(&marathon, "initialization", Init::NAMED, network.initialization)?,
        },
        statistics: StatisticsConfig {
            normalize_observations: settings.normalize,
            follow_statistics: marathon.flag("follow_statistics", statistics.follow_statistics)?,
            observation_clip: marathon.number("observation_clip", Range::Positive, statistics.observation_clip)?,
            scale_rewards: marathon.flag("scale_rewards", statistics.scale_rewards)?,
            statistics_cap: marathon.number("statistics_cap", Range::Positive, statistics.statistics_cap)?,
        },
        rewards: [task].into_iter().chain(signals).collect(),
        algorithm,
        roles: Default::default(),
    };
    config.validate().map_err(|source| ConfigError::Combination {
        path: path.into(),
        agent: top.name().to_string(),
        source,
    })?;
    Ok(Loaded {
        config,
        options: options(&marathon)?,
        buffer: (!is_sac && marathon.get("horizon").is_none()).then_some(settings.buffer_size),
        summary_freq: settings.summary_freq.saturating_mul(scale),
        checkpoint_interval: settings.checkpoint_interval.saturating_mul(scale),
        keep_checkpoints: settings.keep_checkpoints as usize,
        notes: notes.0,
    })
}

/// As many agents as fill the buffer with one stretch of `time_horizon` decisions each, where nobody says how many.
fn agents(
    marathon: &Section<'_>,
    settings: &Settings,
    base: &TrainConfig,
    steps_per_agent: bool,
) -> Result<u64, ConfigError> {
    let block = BLOCK as u64;
    let default = match base.algorithm {
        Algorithm::A2c(_) | Algorithm::Acktr(_) | Algorithm::Sac(_) => base.run.agents as u64,
        Algorithm::Ppo(_) if steps_per_agent => PAPER_AGENTS,
        Algorithm::Ppo(_) => (settings.buffer_size / settings.time_horizon).clamp(block, MOST_AGENTS) / block * block,
    };
    let Some(entry) = marathon.get("agents") else { return Ok(default) };
    let agents = entry.count(1..=1 << 31)?;
    if !RunConfig::fills_lanes(agents as usize) {
        let expected = format!("a multiple of {block}, such as {}, or 1, 2, 4 or 8", agents.next_multiple_of(block));
        return Err(ConfigError::value(entry.place, entry.node.describe(), expected));
    }
    Ok(agents)
}

fn widths(marathon: &Section<'_>, key: &str, default: Vec<usize>) -> Result<Vec<usize>, ConfigError> {
    let Some(entry) = marathon.get(key) else { return Ok(default) };
    let items = entry.items("a list of widths such as [64, 64]")?;
    items.iter().map(|item| Ok(item.count(1..=65_536)? as usize)).collect()
}

/// Notes settings that mean nothing to the algorithm.
fn note_others(hyperparameters: &Section<'_>, marathon: &Section<'_>, algorithm: &Algorithm, notes: &mut Notes) {
    let own: &[&[&str]] = match algorithm {
        Algorithm::Ppo(_) => &[&ON_POLICY, &PPO],
        Algorithm::A2c(_) => &[&ON_POLICY, &A2C],
        Algorithm::Acktr(_) => &[&ON_POLICY, &ACKTR],
        Algorithm::Sac(_) => &[&SAC],
    };
    let all = [&ON_POLICY[..], &PPO, &A2C, &ACKTR, &SAC].concat();
    let others: BTreeSet<&str> = all.into_iter().filter(|key| !own.concat().contains(key)).collect();
    let name = algorithm.name();
    if let Algorithm::A2c(_) | Algorithm::Acktr(_) = algorithm {
        for (keys, why) in [
            (["epsilon", "epsilon_schedule"], "bounds no ratio"),
            (["num_epoch", "batch_size"], "makes one step on each rollout"),
        ] {
            for entry in keys.into_iter().filter_map(|key| hyperparameters.get(key)) {
                notes.ignored(&entry, &format!("{name} {why}"));
            }
        }
    }
    for entry in others.into_iter().filter_map(|key| marathon.get(key)) {
        notes.ignored(&entry, &format!("{name} has no such setting"));
    }
}

/// What the algorithms' settings are read from.
struct From<'f, 'a> {
    marathon: &'f Section<'a>,
    hyperparameters: &'f Section<'a>,
    settings: &'f Settings,
    schedule: Schedule,
}

impl From<'_, '_> {
    fn positive(&self, key: &str, default: f64) -> Result<f64, ConfigError> {
        self.marathon.number(key, Range::Positive, default)
    }
    fn fraction(&self, key: &str, default: f64) -> Result<f64, ConfigError> {
        self.marathon.number(key, Range::Fraction, default)
    }

    fn ppo(&self, base: Ppo) -> Result<Ppo, ConfigError> {
        let Self { marathon, settings, .. } = self;
        let minibatches = (settings.buffer_size / settings.batch_size).max(1);
        let last_epsilon = settings.epsilon.min(LAST_EPSILON);
        let target_kl = self.positive("target_kl", base.target_kl.first)?;
        Ok(Ppo {
            minibatches: marathon.count("minibatches", 1..=1 << 31, minibatches)? as usize,
            epochs: settings.num_epoch as usize,
            lr: settings.learning_rate,
            value_lr: self.positive("value_lr", settings.learning_rate)?,
            value_warmup: marathon.count("value_warmup", 0..=1 << 31, base.value_warmup)?,
            schedule: self.schedule,
            target_kl: self.moving(target_kl, "final_target_kl", Range::Positive, None)?,
            lr_range: lr_range(marathon, base.lr_range)?,
            adam_epsilon: self.positive("adam_epsilon", base.adam_epsilon)?,
            max_grad_norm: self.positive("max_grad_norm", base.max_grad_norm)?,
            gae_lambda: settings.lambd,
            ratio: one_of(marathon, "ratio", Ratio::NAMED, base.ratio)?,
            clip: self.moving(
                settings.epsilon,
                "final_clip",
                Range::Positive,
                (settings.epsilon_schedule == Decay::Linear).then_some(last_epsilon),
            )?,
            value_clip: match marathon.get("value_clip") {
                Some(entry) if entry.node.is_null() => None,
                Some(entry) => Some(entry.number(Range::Positive)?),
                None => base.value_clip,
            },
            entropy_coef: self.entropy_coef()?,
            deviations: self.deviations(base.deviations)?,
        })
    }

    fn a2c(&self, base: A2c) -> Result<A2c, ConfigError> {
        Ok(A2c {
            lr: self.settings.learning_rate,
            schedule: self.schedule,
            max_grad_norm: self.positive("max_grad_norm", base.max_grad_norm)?,
            gae_lambda: self.settings.lambd,
            entropy_coef: self.entropy_coef()?,
            deviations: self.deviations(base.deviations)?,
            value_coef: self.positive("value_coef", base.value_coef)?,
            rms_decay: self.fraction("rms_decay", base.rms_decay)?,
            rms_epsilon: self.positive("rms_epsilon", base.rms_epsilon)?,
        })
    }

    fn acktr(&self, base: Acktr) -> Result<Acktr, ConfigError> {
        Ok(Acktr {
            lr: self.settings.learning_rate,
            schedule: self.schedule,
            gae_lambda: self.settings.lambd,
            entropy_coef: self.entropy_coef()?,
            deviations: self.deviations(base.deviations)?,
            value_coef: self.positive("value_coef", base.value_coef)?,
            kl_clip: self.positive("kl_clip", base.kl_clip)?,
            momentum: self.fraction("momentum", base.momentum)?,
            damping: self.positive("damping", base.damping)?,
            stats_decay: self.fraction("stats_decay", base.stats_decay)?,
            inverse_every: self.marathon.count("inverse_every", 1..=1 << 31, base.inverse_every)?,
        })
    }

    /// `rollout` is the number of steps of a rollout.
    fn sac(&self, base: Sac, rollout: u64) -> Result<Sac, ConfigError> {
        let Self { marathon, hyperparameters, settings, .. } = self;
        let steps_per_update = hyperparameters.number("steps_per_update", Range::Positive, 1.0)?;
        let updates = (rollout as f64 / steps_per_update).round().max(1.0) as u64;
        Ok(Sac {
            lr: settings.learning_rate,
            value_lr: self.positive("value_lr", settings.learning_rate)?,
            schedule: self.schedule,
            adam_epsilon: self.positive("adam_epsilon", base.adam_epsilon)?,
            replay: settings.buffer_size as usize,
            warmup: hyperparameters.count("buffer_init_steps", 0..=1 << 53, 0)?,
            batch: settings.batch_size as usize,
            updates: marathon.count("updates", 1..=1 << 31, updates)? as usize,
            tau: hyperparameters.number("tau", Range::Positive, 0.005)?,
            n_step: marathon.count("n_step", 1..=1 << 16, 1)? as usize,
            init_alpha: hyperparameters.number("init_entcoef", Range::Positive, 1.0)?,
        })
    }

    fn entropy_coef(&self) -> Result<Moving, ConfigError> {
        let Settings { beta, beta_schedule, .. } = *self.settings;
        let last = (beta_schedule == Decay::Linear).then_some(beta.min(LAST_BETA));
        self.moving(beta, "final_entropy_coef", Range::NotNegative, last)
    }

    fn deviations(&self, base: Deviations) -> Result<Deviations, ConfigError> {
        let min_std = self.positive("min_std", base.min_std.first)?;
        Ok(Deviations {
            action_clip: self.positive("action_clip", base.action_clip)?,
            init_log_std: self.marathon.number("init_log_std", Range::Finite, base.init_log_std)?,
            min_std: self.moving(min_std, "final_min_std", Range::Positive, None)?,
            max_std: self.positive("max_std", base.max_std)?,
        })
    }

    /// A setting that ends at Marathon's own key, or where ML-Agents' decay ends, or stays.
    fn moving(&self, first: f64, key: &str, range: Range, decayed: Option<f64>) -> Result<Moving, ConfigError> {
        let last = match self.marathon.get(key) {
            Some(entry) if entry.node.is_null() => None,
            Some(entry) => Some(entry.number(range)?),
            None => decayed,
        };
        Ok(Moving { first, last: last.unwrap_or(first) })
    }
}

/// A choice by its name.
fn one_of<T: Copy, const N: usize>(
    marathon: &Section<'_>,
    key: &str,
    choices: [(&str, T); N],
    default: T,
) -> Result<T, ConfigError> {
    let Some(entry) = marathon.get(key) else { return Ok(default) };
    Ok(choices[entry.word(&choices.map(|(name, _)| name))?].1)
}

/// The rate's schedule: ML-Agents', or the one that only Marathon has.
fn schedule(
    marathon: &Section<'_>,
    hyperparameters: &Section<'_>,
    decay: Decay,
    notes: &mut Notes,
) -> Result<Schedule, ConfigError> {
    let of_file = match decay {
        Decay::Constant => Schedule::Constant,
        Decay::Linear => Schedule::Linear,
    };
    let Some(entry) = marathon.get("schedule") else { return Ok(of_file) };
    let chosen =
        [Schedule::Constant, Schedule::Linear, Schedule::Adaptive][entry.word(&["constant", "linear", "adaptive"])?];
    // it still moves beta and epsilon
    if let Some(entry) =
        hyperparameters.get("learning_rate_schedule").filter(|_| decay == Decay::Linear && chosen != of_file)
    {
        notes.about(&entry, "does not move the learning rate: 'schedule' of the 'marathon:' section does");
    }
    Ok(chosen)
}

fn lr_range(marathon: &Section<'_>, default: [f64; 2]) -> Result<[f64; 2], ConfigError> {
    let Some(entry) = marathon.get("lr_range") else { return Ok(default) };
    let expected = "two positive numbers in ascending order, such as [1e-5, 3e-3]";
    let items: Vec<Entry<'_>> = entry.items(expected)?;
    let numbers: Vec<f64> = items.iter().map(|item| item.number(Range::Positive)).collect::<Result<_, _>>()?;
    match numbers[..] {
        [low, high] if low <= high => Ok([low, high]),
        _ => Err(ConfigError::value(entry.place, format!("{numbers:?}"), expected)),
    }
}

//! From a behavior of a file to the trainer's configuration.

use super::Loaded;
use super::behavior::{Behavior, Notes};
use super::error::ConfigError;
use super::section::{Entry, Range, Section};
use super::settings::{Decay, Settings};
use marathon_learn::{A2c, Acktr, Activation, Algorithm, BLOCK, Init, PpoConfig, Ratio, Sac, Schedule};
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
const COMMON: [&str; 32] = [
    "agents",
    "horizon",
    "rollouts",
    "minibatches",
    "actor_hidden",
    "critic_hidden",
    "activation",
    "value_lr",
    "schedule",
    "target_kl",
    "final_target_kl",
    "lr_range",
    "max_grad_norm",
    "adam_epsilon",
    "value_clip",
    "ratio",
    "initialization",
    "action_clip",
    "final_clip",
    "final_entropy_coef",
    "init_log_std",
    "min_std",
    "final_min_std",
    "max_std",
    "follow_statistics",
    "observation_clip",
    "scale_rewards",
    "statistics_cap",
    "seed",
    "threads",
    "without",
    "steps_per_agent",
];

/// Those of the algorithms' own settings.
const A2C: [&str; 3] = ["value_coef", "rms_decay", "rms_epsilon"];
const ACKTR: [&str; 6] = ["value_coef", "kl_clip", "momentum", "damping", "stats_decay", "inverse_every"];
const SAC: [&str; 2] = ["updates", "n_step"];

/// The trainer's configuration, with the values of its base for all that the file leaves out.
///
/// # Errors
/// If a value is wrong, or the values do not go together.
pub fn convert(path: &Path, behavior: Behavior<'_>) -> Result<Loaded, ConfigError> {
    let settings = Settings::read(&behavior)?;
    let Behavior { top, hyperparameters, marathon, mut notes, seed, base, signals, extrinsic, .. } = behavior;
    let strength = extrinsic.number("strength", Range::Positive, 1.0)?;
    marathon.only(&[&COMMON[..], &A2C, &ACKTR, &SAC].concat())?;

    let steps_per_agent = marathon.flag("steps_per_agent", behavior.steps_per_agent)?;
    let agents = agents(&marathon, &settings, &base, steps_per_agent)?;
    // an update waits until the buffer is full
    let is_sac = matches!(base.algorithm, Algorithm::Sac(_));
    let rollout = if is_sac { base.horizon as u64 } else { settings.buffer_size.div_ceil(agents) };
    let horizon = marathon.count("horizon", 1..=1 << 31, rollout)?;
    if let Some(entry) = hyperparameters.get("buffer_size").filter(|_| horizon != rollout) {
        notes.ignored(&entry, &format!("'horizon' of the 'marathon:' section makes rollouts of {}", agents * horizon));
    }
    let is_ppo = base.algorithm == Algorithm::Ppo;
    for key in ["epsilon", "epsilon_schedule"] {
        if let Some(entry) = hyperparameters.get(key).filter(|_| !is_ppo) {
            notes.ignored(&entry, &format!("{} bounds no ratio", base.algorithm.name()));
        }
    }
    note_others(&marathon, base.algorithm, &mut notes);
    if let Some(entry) = top.get("time_horizon").filter(|_| settings.time_horizon != horizon && !is_sac) {
        let why = "each of the N agents adds M decisions to a rollout and the values of the states reached stand for the rest";
        notes.ignored(&entry, &why.replace("N", &agents.to_string()).replace("M", &horizon.to_string()));
    }
    let minibatches = if is_sac { 1 } else { (settings.buffer_size / settings.batch_size).max(1) };
    let scale = if steps_per_agent { agents } else { 1 };
    if let Some(entry) = top.get("max_steps").filter(|_| scale > 1) {
        let all = settings.max_steps.saturating_mul(scale);
        notes.about(&entry, &format!("counts the steps of each agent: {all} steps of {scale} agents in all"));
    }

    let hidden = vec![settings.hidden_units as usize; settings.num_layers as usize];
    let actor_hidden = widths(&marathon, "actor_hidden", hidden)?;
    let last_epsilon = settings.epsilon.min(LAST_EPSILON);
    let last_beta = settings.beta.min(LAST_BETA);
    let [min_std, max_std] = [base.min_std, base.max_std];
    let ppo = PpoConfig {
        algorithm: match base.algorithm {
            Algorithm::Sac(_) => sac(&marathon, &hyperparameters, &settings, agents * horizon)?,
            other => on_policy(&marathon, other)?,
        },
        agents: agents as usize,
        horizon: horizon as usize,
        rollouts: marathon.count("rollouts", 1..=1 << 31, base.rollouts as u64)? as usize,
        minibatches: marathon.count("minibatches", 1..=1 << 31, minibatches)? as usize,
        epochs: settings.num_epoch as usize,
        total_steps: settings.max_steps.saturating_mul(scale),

        critic_hidden: widths(&marathon, "critic_hidden", actor_hidden.clone())?,
        actor_hidden,
        activation: one_of(&marathon, "activation", Activation::ALL.map(|a| (a.name(), a)), base.activation)?,
        initialization: one_of(&marathon, "initialization", Init::NAMED, base.initialization)?,

        lr: settings.learning_rate,
        value_lr: marathon.number("value_lr", Range::Positive, settings.learning_rate)?,
        schedule: schedule(&marathon, &hyperparameters, settings.learning_rate_schedule, &mut notes)?,
        target_kl: marathon.number("target_kl", Range::Positive, base.target_kl)?,
        final_target_kl: end(&marathon, "final_target_kl", Range::Positive, Decay::Constant, base.target_kl)?,
        lr_range: lr_range(&marathon, base.lr_range)?,
        adam_epsilon: marathon.number("adam_epsilon", Range::Positive, base.adam_epsilon)?,
        max_grad_norm: marathon.number("max_grad_norm", Range::Positive, base.max_grad_norm)?,

        gamma: settings.gamma,
        // alone, its scale cancels
        reward_strength: if signals.is_empty() { 1.0 } else { strength },
        signals,
        gae_lambda: settings.lambd,
        ratio: one_of(&marathon, "ratio", Ratio::NAMED, base.ratio)?,
        clip: settings.epsilon,
        final_clip: match is_ppo {
            true => end(&marathon, "final_clip", Range::Positive, settings.epsilon_schedule, last_epsilon)?,
            false => None,
        },
        value_clip: match marathon.get("value_clip") {
            Some(entry) if entry.node.is_null() => None,
            Some(entry) => Some(entry.number(Range::Positive)?),
            None => base.value_clip,
        },
        entropy_coef: settings.beta,
        final_entropy_coef: end(
            &marathon,
            "final_entropy_coef",
            Range::NotNegative,
            settings.beta_schedule,
            last_beta,
        )?,

        action_clip: marathon.number("action_clip", Range::Positive, base.action_clip)?,
        init_log_std: marathon.number("init_log_std", Range::Finite, base.init_log_std)?,
        min_std: marathon.number("min_std", Range::Positive, min_std)?,
        final_min_std: end(&marathon, "final_min_std", Range::Positive, Decay::Constant, min_std)?,
        max_std: marathon.number("max_std", Range::Positive, max_std)?,

        normalize_observations: settings.normalize,
        follow_statistics: marathon.flag("follow_statistics", base.follow_statistics)?,
        observation_clip: marathon.number("observation_clip", Range::Positive, base.observation_clip)?,
        scale_rewards: marathon.flag("scale_rewards", base.scale_rewards)?,
        statistics_cap: marathon.number("statistics_cap", Range::Positive, base.statistics_cap)?,

        seed: marathon.count("seed", 0..=u64::MAX, seed.unwrap_or(base.seed))?,
        threads: marathon.count("threads", 0..=65_536, base.threads as u64)? as usize,
    };
    ppo.validate().map_err(|source| ConfigError::Combination {
        path: path.into(),
        agent: top.name().to_string(),
        source,
    })?;
    Ok(Loaded {
        ppo,
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
    base: &PpoConfig,
    steps_per_agent: bool,
) -> Result<u64, ConfigError> {
    let block = BLOCK as u64;
    let default = match base.algorithm {
        Algorithm::A2c(_) | Algorithm::Acktr(_) | Algorithm::Sac(_) => base.agents as u64,
        Algorithm::Ppo if steps_per_agent => PAPER_AGENTS,
        Algorithm::Ppo => (settings.buffer_size / settings.time_horizon).clamp(block, MOST_AGENTS) / block * block,
    };
    let Some(entry) = marathon.get("agents") else { return Ok(default) };
    let agents = entry.count(1..=1 << 31)?;
    if !PpoConfig::fills_lanes(agents as usize) {
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

/// Notes settings of other algorithms, which are without effect.
fn note_others(marathon: &Section<'_>, algorithm: Algorithm, notes: &mut Notes) {
    let own: &[&str] = match algorithm {
        Algorithm::Ppo => &[],
        Algorithm::A2c(_) => &A2C,
        Algorithm::Acktr(_) => &ACKTR,
        Algorithm::Sac(_) => &SAC,
    };
    let others: BTreeSet<&str> = A2C.into_iter().chain(ACKTR).chain(SAC).filter(|key| !own.contains(key)).collect();
    for entry in others.into_iter().filter_map(|key| marathon.get(key)) {
        notes.ignored(&entry, &format!("{} has no such setting", algorithm.name()));
    }
}

/// An algorithm that learns from its own rollouts, with what the section says of its settings.
fn on_policy(marathon: &Section<'_>, base: Algorithm) -> Result<Algorithm, ConfigError> {
    let positive = |key, default| marathon.number(key, Range::Positive, default);
    let fraction = |key, default| marathon.number(key, Range::Fraction, default);
    Ok(match base {
        Algorithm::Ppo | Algorithm::Sac(_) => base,
        Algorithm::A2c(a2c) => Algorithm::A2c(A2c {
            value_coef: positive("value_coef", a2c.value_coef)?,
            rms_decay: fraction("rms_decay", a2c.rms_decay)?,
            rms_epsilon: positive("rms_epsilon", a2c.rms_epsilon)?,
        }),
        Algorithm::Acktr(acktr) => Algorithm::Acktr(Acktr {
            value_coef: positive("value_coef", acktr.value_coef)?,
            kl_clip: positive("kl_clip", acktr.kl_clip)?,
            momentum: fraction("momentum", acktr.momentum)?,
            damping: positive("damping", acktr.damping)?,
            stats_decay: fraction("stats_decay", acktr.stats_decay)?,
            inverse_every: marathon.count("inverse_every", 1..=1 << 31, acktr.inverse_every)?,
        }),
    })
}

/// SAC's settings; `rollout` is the number of steps of a rollout.
fn sac(
    marathon: &Section<'_>,
    hyperparameters: &Section<'_>,
    settings: &Settings,
    rollout: u64,
) -> Result<Algorithm, ConfigError> {
    let steps_per_update = hyperparameters.number("steps_per_update", Range::Positive, 1.0)?;
    let updates = (rollout as f64 / steps_per_update).round().max(1.0) as u64;
    Ok(Algorithm::Sac(Sac {
        replay: settings.buffer_size as usize,
        warmup: hyperparameters.count("buffer_init_steps", 0..=1 << 53, 0)?,
        batch: settings.batch_size as usize,
        updates: marathon.count("updates", 1..=1 << 31, updates)? as usize,
        tau: hyperparameters.number("tau", Range::Positive, 0.005)?,
        n_step: marathon.count("n_step", 1..=1 << 16, 1)? as usize,
        init_alpha: hyperparameters.number("init_entcoef", Range::Positive, 1.0)?,
    }))
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

/// A value at the end of the run: Marathon's own, or where ML-Agents' decay ends, or none.
fn end(marathon: &Section<'_>, key: &str, range: Range, decay: Decay, last: f64) -> Result<Option<f64>, ConfigError> {
    match marathon.get(key) {
        Some(entry) if entry.node.is_null() => Ok(None),
        Some(entry) => entry.number(range).map(Some),
        None => Ok((decay == Decay::Linear).then_some(last)),
    }
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

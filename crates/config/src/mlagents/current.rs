//! The present format of ML-Agents: `behaviors:` with nested sections.

use super::behavior::{Behavior, Format, Notes, select};
use super::features::{NETWORK, off, refuse, reward_signals, threaded, trainer, visual};
use crate::document::Map;
use crate::error::ConfigError;
use crate::section::{Range, Section};
use marathon_learn::Algorithm;
use std::path::Path;

/// Sections of a file. A file with one of them is in this format.
pub const TOP: [&str; 8] = [
    "behaviors",
    "default_settings",
    "env_settings",
    "engine_settings",
    "environment_parameters",
    "checkpoint_settings",
    "torch_settings",
    "debug",
];
const BEHAVIOR: [&str; 15] = [
    "trainer_type",
    "hyperparameters",
    "network_settings",
    "reward_signals",
    "max_steps",
    "time_horizon",
    "summary_freq",
    "checkpoint_interval",
    "keep_checkpoints",
    "even_checkpoints",
    "threaded",
    "init_path",
    "self_play",
    "behavioral_cloning",
    "framework",
];
const HYPERPARAMETERS: [&str; 11] = [
    "batch_size",
    "buffer_size",
    "learning_rate",
    "learning_rate_schedule",
    "beta",
    "beta_schedule",
    "epsilon",
    "epsilon_schedule",
    "lambd",
    "num_epoch",
    "shared_critic",
];
/// The same of SAC.
const SAC: [&str; 10] = [
    "batch_size",
    "buffer_size",
    "learning_rate",
    "learning_rate_schedule",
    "buffer_init_steps",
    "init_entcoef",
    "tau",
    "steps_per_update",
    "save_replay_buffer",
    "reward_signal_steps_per_update",
];
const ENV: [&str; 10] = [
    "env_path",
    "env_args",
    "base_port",
    "num_envs",
    "num_areas",
    "timeout_wait",
    "seed",
    "max_lifetime_restarts",
    "restarts_rate_limit_n",
    "restarts_rate_limit_period_s",
];
const ENGINE: [&str; 8] = [
    "width",
    "height",
    "quality_level",
    "time_scale",
    "target_frame_rate",
    "capture_frame_rate",
    "no_graphics",
    "no_graphics_monitor",
];
const CHECKPOINT: [&str; 8] =
    ["run_id", "initialize_from", "load_model", "resume", "force", "train_model", "inference", "results_dir"];

/// Finds an agent's settings and refuses what is misspelled or not supported.
///
/// # Errors
/// Says what, where, and what would do.
pub fn read<'a>(path: &'a Path, map: &'a Map, agent: &str) -> Result<Behavior<'a>, ConfigError> {
    let mut notes = Notes::default();
    let root = Section::root(path, map);
    root.only(&TOP)?;
    let behaviors = root.section("behaviors")?;
    let seed = around(&root, &mut notes)?;
    let top = select(path, agent, &behaviors, root.section("default_settings")?, "default_settings", &mut notes)?;

    top.only(&BEHAVIOR)?;
    let hyperparameters = top.section("hyperparameters")?;
    let network = top.section("network_settings")?;

    let base = trainer(top.get("trainer_type"))?;
    match &base.algorithm {
        Algorithm::Sac(_) => {
            hyperparameters.only(&SAC)?;
            for key in ["save_replay_buffer", "reward_signal_steps_per_update"] {
                if let Some(entry) = hyperparameters.set(key) {
                    notes.ignored(&entry, "checkpoints hold the replay, and there are no signals with SAC");
                }
            }
        }
        _ => hyperparameters.only(&HYPERPARAMETERS)?,
    }
    off(&hyperparameters, "shared_critic", "one network for policy and value")?;

    network.only(&NETWORK)?;
    refuse(network.set("memory"), "recurrent memory", "null")?;
    visual(&network, &mut notes)?;
    if let Some(entry) = network.set("goal_conditioning_type") {
        entry.word(&["hyper", "none"])?;
    }
    if let Some(entry) = network.set("deterministic")
        && entry.flag()?
    {
        notes.ignored(&entry, "training explores, and evaluation takes the mean action");
    }
    if let Some(entry) = network.set("max_num_agents") {
        notes.ignored(&entry, "it is for agents in groups");
    }

    let (extrinsic, signals) = reward_signals(&top, &mut notes)?;
    refuse(top.set("self_play"), "self-play", "null")?;
    refuse(top.set("init_path"), "starting from another run", "null")?;
    refuse(top.set("behavioral_cloning"), "behavioral cloning", "null")?;
    threaded(&top, &mut notes)?;
    if let Some(entry) = top.set("framework") {
        notes.ignored(&entry, "there is one trainer");
    }
    let format = Format::Current;
    Ok(Behavior {
        format,
        base,
        top,
        hyperparameters,
        network,
        extrinsic,
        signals,
        steps_per_agent: false,
        seed,
        notes,
    })
}

/// The sections beside the behaviors: what is harmless is noted, what would change the result is refused. Returns the
/// seed.
fn around(root: &Section<'_>, notes: &mut Notes) -> Result<Option<u64>, ConfigError> {
    if let Some(entry) = root.set("environment_parameters")
        && !root.section("environment_parameters")?.is_empty()
    {
        return refuse(Some(entry), "a curriculum or randomized environment", "no environment parameters")
            .map(|()| None);
    }
    let env = root.section("env_settings")?;
    env.only(&ENV)?;
    for key in ["num_envs", "num_areas"] {
        if let Some(entry) = env.set(key) {
            notes.ignored(&entry, "the buffer and the horizon say how many agents there are, unless the run does");
        }
    }
    for key in ["env_path", "env_args"] {
        if let Some(entry) = env.set(key) {
            notes.ignored(&entry, "the agents are built in");
        }
    }
    // -1 lets ML-Agents choose one
    let seed = match env.set("seed") {
        Some(entry) if entry.number(Range::Finite)? == -1.0 => None,
        Some(entry) => Some(entry.count(0..=u64::MAX)?),
        None => None,
    };

    root.section("engine_settings")?.only(&ENGINE)?;
    let torch = root.section("torch_settings")?;
    torch.only(&["device"])?;
    for (key, why) in [("engine_settings", "no game engine runs"), ("torch_settings", "training is on the processor")] {
        if let Some(entry) = root.set(key) {
            notes.ignored(&entry, why);
        }
    }

    let checkpoint = root.section("checkpoint_settings")?;
    checkpoint.only(&CHECKPOINT)?;
    for key in ["load_model", "resume", "inference"] {
        off(&checkpoint, key, "choosing by a file what to do with a run")?;
    }
    refuse(checkpoint.set("initialize_from"), "starting from another run", "null")?;
    for key in ["run_id", "results_dir", "force"] {
        if let Some(entry) = checkpoint.set(key) {
            notes.ignored(&entry, "the results' folder is an option of the command line");
        }
    }
    Ok(seed)
}

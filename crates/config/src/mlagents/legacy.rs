//! The format of ML-Agents before version 0.16, that of the paper: a section per brain with flat keys, and `default:`
//! below all of them.

use super::behavior::{Behavior, Format, Notes, select};
use super::features::{off, refuse, reward_signals, threaded, trainer, visual};
use crate::document::Map;
use crate::error::ConfigError;
use crate::section::{Range, Section};
use marathon_learn::{Algorithm, Novelty, RewardConfig, RewardKind};
use std::path::Path;

/// Keys of a section.
pub const BRAIN: [&str; 32] = [
    "trainer",
    "batch_size",
    "buffer_size",
    "learning_rate",
    "learning_rate_schedule",
    "beta",
    "beta_schedule",
    "epsilon",
    "epsilon_schedule",
    "lambd",
    "gamma",
    "num_epoch",
    "normalize",
    "hidden_units",
    "num_layers",
    "max_steps",
    "time_horizon",
    "summary_freq",
    "keep_checkpoints",
    "use_recurrent",
    "memory_size",
    "sequence_length",
    "use_curiosity",
    "curiosity_strength",
    "curiosity_enc_size",
    "vis_encode_type",
    "reward_signals",
    "threaded",
    "init_path",
    "self_play",
    "behavioral_cloning",
    "pretraining",
];

/// Finds an agent's settings and refuses what is misspelled or not supported.
///
/// # Errors
/// Says what, where, and what would do.
pub fn read<'a>(path: &'a Path, map: &'a Map, agent: &str) -> Result<Behavior<'a>, ConfigError> {
    let mut notes = Notes::default();
    let root = Section::root(path, map);
    let top = select(path, agent, &root, root.section("default")?, "default", &mut notes)?;
    // the trainer first: others have other keys
    let base = trainer(top.get("trainer"))?;
    if let Algorithm::Sac(_) = base.algorithm {
        refuse(top.get("trainer"), "SAC in a file of this format", "the present format, with 'behaviors:'")?;
    }
    top.only(&BRAIN)?;
    off(&top, "use_recurrent", "recurrent memory")?;
    for key in ["behavioral_cloning", "pretraining"] {
        refuse(top.set(key), "behavioral cloning", "null")?;
    }
    visual(&top, &mut notes)?;
    threaded(&top, &mut notes)?;
    refuse(top.set("self_play"), "self-play", "null")?;
    refuse(top.set("init_path"), "starting from another run", "null")?;
    let (extrinsic, mut signals) = reward_signals(&top, &mut notes)?;
    signals.extend(curiosity(&top, &mut notes)?);
    Ok(Behavior {
        format: Format::Legacy,
        base,
        hyperparameters: top.clone(),
        network: top.clone(),
        // the discount moved into the reward signals in version 0.9, and steps were counted for all agents together
        // from 0.14 on; nothing tells the versions in between apart
        steps_per_agent: extrinsic.is_empty(),
        extrinsic: extrinsic.above(top.clone()),
        signals,
        top,
        seed: None,
        notes,
    })
}

/// Curiosity as it was asked for before version 0.9.
fn curiosity(top: &Section<'_>, notes: &mut Notes) -> Result<Option<RewardConfig>, ConfigError> {
    let strength = top.number("curiosity_strength", Range::NotNegative, 0.01)?;
    let size = top.count("curiosity_enc_size", 1..=4096, 128)? as usize;
    let Some(entry) = top.set("use_curiosity") else { return Ok(None) };
    if !entry.flag()? || strength == 0.0 {
        return Ok(None);
    }
    notes.about(&entry, "has a value stream of its own; versions before 0.9 added it to the task's reward");
    let gamma = top.number("gamma", Range::Fraction, 0.99)?;
    let kind = RewardKind::Curiosity(Novelty { hidden: vec![size; 2], ..Default::default() });
    Ok(Some(RewardConfig { kind, strength, gamma }))
}

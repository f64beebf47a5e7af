//! The part of a file that speaks of one agent, the same for both formats.

use crate::error::{ConfigError, shown};
use crate::names;
use crate::section::{Entry, Section};
use marathon_learn::{RewardConfig, TrainConfig};
use marathon_physics::hint::nearest;
use std::path::Path;

/// The two formats of ML-Agents.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// `behaviors:` with nested sections, since version 0.16.
    Current,
    /// A section per brain with flat keys, before.
    Legacy,
}

/// Settings of one agent, by topic. In the old format the first three are the same section.
pub struct Behavior<'a> {
    pub format: Format,
    /// Defaults for keys that the file leaves out; they depend on the trainer.
    pub base: TrainConfig,
    /// Settings that stand in no section.
    pub top: Section<'a>,
    pub hyperparameters: Section<'a>,
    pub network: Section<'a>,
    /// Of the reward that the task gives.
    pub extrinsic: Section<'a>,
    /// The other rewards.
    pub signals: Vec<RewardConfig>,
    /// Whether steps are counted for each agent by itself, not for all together.
    pub steps_per_agent: bool,
    /// Seed that the file gives for the whole run.
    pub seed: Option<u64>,
    pub notes: Notes,
}

/// Notes for the user about a valid file.
#[derive(Default)]
pub struct Notes(pub Vec<String>);

impl Notes {
    /// Says something about a key.
    pub fn about(&mut self, entry: &Entry<'_>, text: &str) {
        let place = &entry.place;
        let line = if place.line > 0 { format!("line {}: ", place.line) } else { String::new() };
        self.0.push(format!("{line}{} {text}", shown(&place.key)));
    }
    /// A key that does nothing here.
    pub fn ignored(&mut self, entry: &Entry<'_>, why: &str) {
        self.about(entry, &format!("has no effect: {why}"));
    }
}

/// The section of an agent above the one that serves all agents.
///
/// # Errors
/// If there is neither.
pub fn select<'a>(
    path: &Path,
    agent: &str,
    behaviors: &Section<'a>,
    default: Section<'a>,
    default_name: &'static str,
    notes: &mut Notes,
) -> Result<Section<'a>, ConfigError> {
    let own: Vec<&str> = behaviors.entries().map(|e| e.key).filter(|key| *key != default_name).collect();
    if let Some(name) = names::find(agent, own.iter().copied()) {
        return Ok(behaviors.section(name)?.above(default));
    }
    if !default.is_empty() {
        // without an agent, the caller asks for what serves all
        if !agent.is_empty() {
            notes.0.push(format!("nothing about {agent} itself: {default_name} applies"));
        }
        return Ok(default);
    }
    let accepted = names::accepted(agent);
    let near = own.iter().find(|key| nearest(key, accepted.iter().copied()).is_some());
    Err(ConfigError::NoSuchBehavior {
        path: path.into(),
        agent: agent.into(),
        nearest: near.map(|key| names_like(key, &accepted)),
        names: if own.is_empty() { "none".into() } else { shown_list(&own) },
        accepted: accepted.join(", "),
        default: default_name,
    })
}

/// The accepted name that a key of the file was meant to be.
fn names_like(key: &str, accepted: &[&str]) -> String {
    format!("{}' for '{}", nearest(key, accepted.iter().copied()).unwrap_or_default(), shown(key))
}

fn shown_list(names: &[&str]) -> String {
    const MOST: usize = 30;
    let mut list: Vec<String> = names.iter().take(MOST).map(|name| shown(name)).collect();
    if names.len() > MOST {
        list.push(format!("{} more", names.len() - MOST));
    }
    list.join(", ")
}

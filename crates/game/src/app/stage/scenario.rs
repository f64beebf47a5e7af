//! The scenario: which characters there are, what moves them, and what they stand on.

use crate::app::mode::Mode;
use crate::app::stage::course::{self, CourseOptions};
use crate::app::stage::policies::ShippedPolicies;
use bevy::prelude::*;
use bevy_marathon::Ground;
use marathon_runs::{RunError, TaskConfig, policy_file};
use std::path::PathBuf;

/// The requested scenario. A change takes effect with a [`LoadScenario`].
#[derive(Resource, Clone, Debug, PartialEq)]
pub struct Scenario {
    /// The mode. `State<Mode>` follows it when the scenario is loaded.
    pub mode: Mode,
    /// Registry name of the agent; unused by the test bed.
    pub agent: String,
    /// Options of the task that the user has chosen, which override those of the policy. Options of another agent are
    /// ignored.
    pub chosen: TaskConfig,
    /// The policy of the characters.
    pub source: PolicySource,
    /// Number of characters.
    pub agents: usize,
    /// The ground; unused by the test bed and on assault courses.
    pub ground: Ground,
    /// The assault course, and the player's role.
    pub course: CourseOptions,
    /// Seed of their starts.
    pub seed: u64,
    /// Model of the test bed.
    pub model: Option<PathBuf>,
}

/// Replaces the characters by those of [`Scenario`], in the frame of the message.
#[derive(Message, Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadScenario;

/// The origin of the policy that moves the characters.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PolicySource {
    /// The policy that comes with the agent.
    Shipped,
    /// A file, read again when it changes.
    File(PathBuf),
    /// The trainer in the window.
    Trainer,
    /// Nothing.
    Nothing,
}

impl Scenario {
    /// The task: the options of the policy, overridden by those that the user has chosen.
    ///
    /// # Errors
    /// If there is no such agent, or the policy's file cannot be read.
    pub fn task_config(&self, shipped: &ShippedPolicies) -> Result<TaskConfig, RunError> {
        let named = TaskConfig::named(&self.agent)?;
        let noted = match &self.source {
            PolicySource::File(path) => policy_file::task_of(path)?,
            PolicySource::Shipped => shipped.policy(&self.agent).map(|policy| TaskConfig::of_policy(policy.0.meta())),
            PolicySource::Trainer | PolicySource::Nothing => None,
        };
        let noted = noted.filter(|noted| noted.agent == named.agent).unwrap_or(named);
        let chosen = Some(&self.chosen).filter(|chosen| chosen.agent == noted.agent);
        let task_config = chosen.map_or_else(|| noted.clone(), |chosen| noted.clone().overlay(chosen));
        Ok(match self.mode {
            Mode::Course => self.course.applied(task_config, chosen),
            _ => task_config,
        })
    }

    /// The ground.
    pub fn stands_on(&self) -> Ground {
        match self.mode {
            Mode::Course if course::has_own(&self.agent) => Ground::Level,
            Mode::Course => Ground::Track,
            _ => self.ground,
        }
    }

    /// Whether the player builds the ground.
    pub fn is_built(&self) -> bool {
        self.mode == Mode::Course && self.course.role == course::PlayerRole::Build
    }

    /// Changes what moves the characters. A file brings its own task; anything else keeps the present one.
    pub fn play(&mut self, source: PolicySource, shipped: &ShippedPolicies) {
        self.chosen = match source {
            PolicySource::File(_) => TaskConfig::default(),
            // a file that can no longer be read has no task to keep
            _ => self.task_config(shipped).unwrap_or_default(),
        };
        self.source = source;
    }
}

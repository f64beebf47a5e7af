//! Errors of ragdolls, their commands and their snapshots.

use marathon_envs::{CommandRange, EnvError};
use marathon_physics::{SimError, hint};
use marathon_runs::RunError;
use thiserror::Error;

/// An error of a [`Ragdoll`](crate::Ragdoll): it cannot be simulated, or an input does not fit it.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RagdollError {
    /// The registry has no such agent, or the agent does not take an option.
    #[error(transparent)]
    Task(#[from] RunError),
    /// The agent or its ground is refused.
    #[error(transparent)]
    Env(#[from] EnvError),
    /// The physics refuses the model.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// A body without a task takes no commands.
    #[error("a body without a task takes no command")]
    NoCommand,
    /// The model of a prefab that shall collide has no geom for obstacles.
    #[error("the model '{model}' has no geom for obstacles; call ModelSpec::add_obstacles before it is compiled")]
    NoObstacles {
        /// Name of the model.
        model: String,
    },
    /// A body without a task has no ground of its own.
    #[error("a body without a task has no ground of its own")]
    NoGround,
    /// A state has too few or too many numbers.
    #[error("{vector} has {found} numbers, expected {expected}")]
    StateLength {
        /// `qpos` or `qvel`.
        vector: &'static str,
        /// Its length.
        found: usize,
        /// The length of the model's.
        expected: usize,
    },
    /// A state has a number that is not finite.
    #[error("{vector} has a number that is {found}, expected finite ones")]
    StateNumber {
        /// `qpos` or `qvel`.
        vector: &'static str,
        /// The number.
        found: f64,
    },
}

/// An error of a number that [`AgentCommand::set`](crate::AgentCommand::set) refuses.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum CommandError {
    /// The character takes no commands, or is not in the simulation yet.
    #[error("no command '{name}': the character takes no commands, or is not in the simulation yet")]
    NoCommands {
        /// The name that was given.
        name: String,
    },
    /// The command has no number of this name.
    #[error("no command '{name}'{}", hint::among(name, known))]
    Unknown {
        /// The name that was given.
        name: String,
        /// The names of the character's task.
        known: Vec<String>,
    },
    /// The value is outside the range of its number.
    #[error("command '{}' is {value}, expected {} to {} {}", range.name, range.low, range.high, range.unit)]
    OutOfRange {
        /// The number with its range and unit.
        range: CommandRange,
        /// The value that was given.
        value: f64,
    },
}

/// Why a snapshot cannot be restored or read. Nothing has changed then.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum SnapshotError {
    /// The ragdoll was despawned.
    #[error("the ragdoll has left the simulation")]
    Gone,
    /// The snapshot is of another agent or prefab.
    #[error("the snapshot is of '{found}', expected '{expected}'")]
    Character {
        /// Task or model of the snapshot.
        found: String,
        /// Task or model of the ragdoll.
        expected: String,
    },
    /// The task has the same name and other options, another clip or another ground.
    #[error("the snapshot is of '{character}' with other task options, another clip or another ground")]
    Task {
        /// Task of both.
        character: String,
    },
    /// The model has changed since.
    #[error("the snapshot is of '{character}' with another model, expected one of the present model")]
    Model {
        /// Task or model of both.
        character: String,
    },
    /// The bytes have the format of another version.
    #[error(
        "the format of the snapshot is '{found}', expected '{expected}': it was saved by another version of Marathon"
    )]
    Format {
        /// Mark at their start.
        found: String,
        /// Mark of this version.
        expected: &'static str,
    },
    /// The bytes are something else.
    #[error("{bytes} bytes that do not begin with the mark '{expected}' of a ragdoll's snapshot")]
    Mark {
        /// Number of bytes.
        bytes: usize,
        /// Mark of a snapshot.
        expected: &'static str,
    },
    /// A byte has changed, or some are missing.
    #[error("the snapshot is damaged or cut short: its checksum is {found:08x}, expected {expected:08x}")]
    Checksum {
        /// Checksum of the bytes.
        found: u32,
        /// Checksum that they note.
        expected: u32,
    },
    /// Its content is inconsistent.
    #[error("the snapshot cannot be used: {0}")]
    Damaged(&'static str),
    /// Its content cannot be decoded.
    #[error("the snapshot cannot be decoded: {0}")]
    Decode(#[from] postcard::Error),
    /// The task refuses its state.
    #[error(transparent)]
    Env(#[from] EnvError),
}

/// An error of a limb that [`LimbStrength::set`](crate::LimbStrength::set) refuses.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum StrengthError {
    /// The character has no actuators, or is not in the simulation yet.
    #[error("no limb '{name}': the character has no actuators, or is not in the simulation yet")]
    NoLimbs {
        /// The name that was given.
        name: String,
    },
    /// The character has no limb of this name.
    #[error("no limb '{name}'{}", hint::among(name, known))]
    Unknown {
        /// The name that was given.
        name: String,
        /// The names of the character's limbs.
        known: Vec<String>,
    },
    /// The factor is outside its range.
    #[error("strength of '{name}' is {factor}, expected a factor of 0 to {strongest}")]
    OutOfRange {
        /// The name of the limb.
        name: String,
        /// The factor that was given.
        factor: f64,
        /// The largest factor.
        strongest: f64,
    },
}
